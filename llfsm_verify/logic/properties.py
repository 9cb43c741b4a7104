"""Property files: named formulas, assumptions, and (later) regular properties."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.lines import Kind, Line, logical_lines, read_line
from llfsm_verify.logic.parsing import Parsed, parse_words
from llfsm_verify.logic.tokens import MAX_TOKENS, tokenise

MAX_MISTAKES = 50
"""Reading ends after so many mistakes."""


@dataclass(frozen=True, slots=True)
class Property:
    """A property as the user wrote it.

    `text` is the formula's text on one line, without comments; `span` the formula's place. `atoms` leads from an atom's
    key in `formula` to the place where it stands, for name resolution and type checking. `formula` is None for the
    regular kinds (`enforce`, `forbid`, `forbid initially`).
    """

    name: str
    kind: Kind
    text: str
    span: Span
    formula: Formula | None
    atoms: Mapping[str, Fragment]


@dataclass(frozen=True, slots=True)
class PropertySet:
    """The properties of all files given, in order; names are unique, those of assumptions too."""

    properties: tuple[Property, ...] = ()

    @property
    def assumptions(self) -> tuple[Property, ...]:
        """The `assume` lines."""
        return tuple(p for p in self.properties if p.kind == "assume")

    @property
    def goals(self) -> tuple[Property, ...]:
        """Everything to be checked: all but the assumptions."""
        return tuple(p for p in self.properties if p.kind != "assume")

    @property
    def atoms(self) -> Mapping[str, Fragment]:
        """All atoms by key, each with the place where it stands first."""
        found: dict[str, Fragment] = {}
        for p in self.properties:
            for key, fragment in p.atoms.items():
                found.setdefault(key, fragment)
        return MappingProxyType(found)

    def __iter__(self) -> Iterator[Property]:
        return iter(self.properties)

    def __len__(self) -> int:
        return len(self.properties)


def parse_properties(sources: Sequence[Source]) -> PropertySet:
    """The properties written in `sources`; DiagnosticError with all mistakes, one per property (E305 to E333)."""
    found: list[Property] = []
    places: dict[str, tuple[Span, bool]] = {}
    mistakes: list[Diagnostic] = []
    for source in sources:
        try:
            for result in _read(source, places):
                if isinstance(result, Property):
                    found.append(result)
                else:
                    mistakes.append(result)
                if len(mistakes) >= MAX_MISTAKES:
                    raise DiagnosticError(mistakes)
        except DiagnosticError as e:
            raise DiagnosticError([*mistakes, *(d for d in e.diagnostics if d not in mistakes)]) from None
    if mistakes:
        raise DiagnosticError(mistakes)
    return PropertySet(tuple(found))


def _read(source: Source, places: dict[str, tuple[Span, bool]]) -> Iterator[Property | Diagnostic]:
    text = Fragment.whole(source)
    tokens = tokenise(source.text)
    if len(tokens) > MAX_TOKENS:
        span = text.span(tokens[-1].start, tokens[-1].end)
        yield Diagnostic(codes.TOO_MANY_WORDS, f"more than {MAX_TOKENS:,} words and signs in one file", span)
        return
    for words in logical_lines(text, tokens):
        try:
            line = read_line(text, words)
            span = text.span(*line.header)
            first = places.setdefault(line.name, (span, line.named))
            if first[0] is not span:
                yield _duplicate(line, span, *first)
                continue
            yield _property(line, text)
        except DiagnosticError as e:
            yield from e.diagnostics


def _property(line: Line, text: Fragment) -> Property:
    words = line.body
    if not words.tokens:
        span = text.span(*line.header)
        raise DiagnosticError(Diagnostic(codes.EMPTY, f"there is no formula behind `{line.name}:`", span))
    last = len(words.tokens) - 1
    if line.kind not in ("ltl", "assume"):
        message = f"regular properties (`{line.kind}`) are not supported yet"
        hint = "write it as an LTL formula"
        raise DiagnosticError(Diagnostic(codes.REGULAR, message, text.span(*line.header), hint=hint))
    parsed: Parsed = parse_words(words)
    return Property(line.name, line.kind, words.text(0, last), words.span(0, last), parsed.formula, parsed.atoms)


def _duplicate(line: Line, span: Span, first: Span, first_named: bool) -> Diagnostic:
    if line.named and first_named:
        return Diagnostic(
            codes.DUPLICATE_NAME, f"there are two properties `{line.name}`", span, (f"the other one is at {first}",)
        )
    message = f"a formula without a name is called after its line, and `{line.name}` is the name of another one"
    return Diagnostic(
        codes.DUPLICATE_NAME, message, span, (f"the other one is at {first}",), hint="write `NAME:` before the formula"
    )
