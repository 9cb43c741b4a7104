"""Property files: named formulas, assumptions, regular properties and automata, in any of the syntaxes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final, Literal

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source, Span
from llfsm_verify.fileformat import judge_format
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import TimeBound, without_steps
from llfsm_verify.logic.formula import BINDING, PAST, TIMED, Formula, atoms, operators, to_text
from llfsm_verify.logic.initial import forgotten
from llfsm_verify.logic.lines import Kind, Line, logical_lines, read_line
from llfsm_verify.logic.parsing.bounds import time_bounds
from llfsm_verify.logic.parsing.definitions import Definitions, Member, family, is_definition, is_family
from llfsm_verify.logic.parsing.delays import refuse_delay_of_sva
from llfsm_verify.logic.parsing.formulas import parse_words
from llfsm_verify.logic.parsing.mistakes import with_habit
from llfsm_verify.logic.parsing.patterns import read_pattern
from llfsm_verify.logic.parsing.tokens import MAX_TOKENS, Token, tokenise
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.reading import GivenLines
from llfsm_verify.logic.syntaxes import SYNTAXES, foreign, parse_in

MAX_MISTAKES = 50
"""Reading ends after so many mistakes."""


Feature = Literal["regular", "automaton", "past", "time", "expressions"]
"""What a property file may hold besides plain temporal logic; step bounds are written out."""

FEATURES: Final[frozenset[Feature]] = frozenset({"regular", "automaton", "past", "time", "expressions"})
PLAIN: Final[frozenset[Feature]] = frozenset()


@dataclass(frozen=True, slots=True)
class Property:
    """A property as the user wrote it.

    `text` is the formula's text on one line, without comments; `span` the formula's place. `atoms` leads from an atom's
    key in `formula` to the place where it stands, for name resolution and type checking. `formula` is None for the
    regular kinds (`enforce`, `forbid`, `forbid initially`), which have an `expression` (of letters, which are state
    formulas), and for `automaton` and `automaton never`, which have the name of a `file` relative to that of `span`.
    `syntax` is that of a formula's text, one of `syntaxes.SYNTAXES`.
    """

    name: str
    kind: Kind
    text: str
    span: Span
    formula: Formula | None
    atoms: Mapping[str, Fragment]
    expression: Formula | None = None
    file: str | None = None
    syntax: str = "llfsm"
    bounds: tuple[tuple[Span, TimeBound], ...] = ()
    """The places of its bounds in time, and these."""
    doubt: Diagnostic | None = None
    """The warning (W302) that it, or a part of it, speaks of the initial configuration only."""
    edges: Mapping[str, Formula] = field(default_factory=dict)
    """What searches read in the place of atoms (`checking.edges`)."""

    @property
    def searched(self) -> Iterable[str]:
        """The keys of the atoms that searches read."""
        edges = self.edges
        return (key for own in self.atoms for key in (atoms(edges[own]) if own in edges else (own,)))


@dataclass(frozen=True, slots=True)
class PropertySet:
    """The properties of all files given, in order; names are unique, those of assumptions too."""

    properties: tuple[Property, ...] = ()
    definitions: Mapping[str, Span] = field(default_factory=dict)
    """The names that `define` lines and families give, each with its place (the first, where several have it)."""

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


def parse_properties(
    sources: Sequence[Source], syntax: str = "llfsm", features: frozenset[Feature] = FEATURES
) -> PropertySet:
    """The properties written in `sources`; DiagnosticError with all mistakes, one per property (E305 to E351).

    A file whose first lines have `# syntax: NAME` is read in that syntax, others in `syntax` (one of
    `syntaxes.SYNTAXES`). `features` are those that the caller can work with: other properties are refused (E315, E335).
    """
    found: list[Property] = []
    places: dict[str, tuple[Span, bool]] = {}
    mistakes: list[Diagnostic] = []
    definitions: dict[str, Span] = {}
    for source in sources:
        try:
            for result in _read(source, places, definitions, syntax, features):
                if isinstance(result, Property):
                    found.append(result)
                elif result not in mistakes:  # the members of a family share theirs
                    mistakes.append(result)
                if len(mistakes) >= MAX_MISTAKES:
                    raise DiagnosticError(mistakes)
        except DiagnosticError as e:
            raise DiagnosticError([*mistakes, *(d for d in e.diagnostics if d not in mistakes)]) from None
    if mistakes:
        raise DiagnosticError(mistakes)
    return PropertySet(tuple(found), MappingProxyType(definitions))


def _read(
    source: Source,
    places: dict[str, tuple[Span, bool]],
    definitions: dict[str, Span],
    syntax: str,
    features: frozenset[Feature],
) -> Iterator[Property | Diagnostic]:
    text = Fragment.whole(source)
    tokens = tokenise(source.text)
    if len(tokens) > MAX_TOKENS:
        span = text.span(tokens[-1].start, tokens[-1].end)
        yield Diagnostic(codes.TOO_MANY_WORDS, f"more than {MAX_TOKENS:,} words and signs in one file", span)
        return
    later = _format_mistake(text, tokens)
    if later is not None:
        yield later
        return
    syntax = named_syntax(text, tokens) or syntax
    starts = source.starts if isinstance(source, GivenLines) else ()
    defined, delays = Definitions(), syntax == "llfsm" and "##" in text.text
    lines: list[tuple[list[Token], Member]] = []
    for words in logical_lines(text, tokens, starts):
        try:
            if delays:
                refuse_delay_of_sva(text, words)
            if syntax == "llfsm" and is_definition(text.text, words[0].start):
                defined.add(text, words)
            elif syntax == "llfsm" and is_family(text.text, words[0].start):
                names, members, words = family(text, words)
                lines += [(words, member) for member in members]
                for name, place in names.items():
                    definitions.setdefault(name, place)
            else:
                lines.append((words, Member()))
        except DiagnosticError as e:
            yield from e.diagnostics
    for name, place in defined.places().items():
        definitions.setdefault(name, place)
    for words, member in lines:
        regular = False
        try:
            line = _named(read_line(text, words), syntax)
            line = replace(line, name=line.name + member.suffix)
            regular = line.kind in ("enforce", "forbid", "forbid initially")
            span = text.span(*line.header)
            first = places.setdefault(line.name, (span, line.named))
            if first[0] is not span:
                yield _duplicate(line, span, *first)
                continue
            yield _property(line, text, syntax, features, defined, member)
        except DiagnosticError as e:
            yield from (with_habit(d, regular) if syntax == "llfsm" else d for d in e.diagnostics)


_FORMAT = re.compile(r"^[ \t]*#[ \t]*format[ \t]*:[ \t]*([0-9]+)[ \t]*$", re.MULTILINE)


def _format_mistake(text: Fragment, tokens: Sequence[Token]) -> Diagnostic | None:
    """What is wrong with the format that a comment before the first property names: nothing, where it is ours."""
    match = _FORMAT.search(text.text)
    first = next((t.start for t in tokens if t.type != "NEWLINE"), len(text.text))
    mistake = None if match is None or match.start() > first else judge_format(match[1], "the file", "# format")
    if match is None or mistake is None:
        return None
    return Diagnostic(codes.FORMAT, mistake[0], text.span(*match.span(1)), hint=mistake[1])


_SYNTAX = re.compile(r"^[ \t]*#[ \t]*syntax[ \t]*:[ \t]*(\S*)", re.MULTILINE)


def named_syntax(text: Fragment, tokens: Sequence[Token]) -> str | None:
    """The syntax that a comment before the first property names; DiagnosticError (E350) when there is no such one."""
    match = _SYNTAX.search(text.text)
    first = next((t.start for t in tokens if t.type != "NEWLINE"), len(text.text))
    if match is None or match.start() > first:
        return None
    if match[1].lower() not in SYNTAXES:
        message = f"there is no syntax `{match[1][:40]}`"
        hint = f"write one of {', '.join(SYNTAXES)}"
        raise DiagnosticError(Diagnostic(codes.UNKNOWN_SYNTAX, message, text.span(*match.span(1)), hint=hint))
    return match[1].lower()


def _named(line: Line, syntax: str) -> Line:
    """A line without a name of ours may have one in the words around the formula: `ltl name { … }`."""
    if line.named or syntax == "llfsm":
        return line
    name = foreign(syntax).name_in(_body(line, syntax).text)
    return line if name is None else replace(line, name=name, named=True)


def _body(line: Line, syntax: str = "llfsm") -> Fragment:
    """The text after the name, from the first word to the last; for Spot to the end of the line.

    What starts with `#` is no comment everywhere in Spot's formulas, and is refused there.
    """
    tokens, text = line.body.tokens, line.body.fragment
    start, end = tokens[0].start, tokens[-1].end
    if syntax == "spot":
        end = (text.text + "\n").index("\n", end)
    return Fragment(text.text[start:end], text.source, text.offsets[start : end + 1])


def _property(
    line: Line, text: Fragment, syntax: str, features: frozenset[Feature], defined: Definitions, member: Member
) -> Property:
    given = words = line.body
    if not words.tokens:
        span = text.span(*line.header)
        what = "file" if line.kind.startswith("automaton") else "formula"
        raise DiagnosticError(Diagnostic(codes.EMPTY, f"there is no {what} after `{line.name}:`", span))
    last = len(words.tokens) - 1
    place = words.span(0, last)
    if syntax == "llfsm" and not line.kind.startswith("automaton"):
        words = defined.written_out(words, member.values)
        last = len(words.tokens) - 1
    if line.kind in ("automaton", "automaton never"):
        _refuse_unless("automaton" in features, f"`{line.kind}` is", text.span(*line.header))
        file = _body(line).text.strip('"')
        if not file or "\n" in file:
            message = f"`{line.kind} {line.name}:` names one file, in the format HOA"
            raise DiagnosticError(
                Diagnostic(codes.AUTOMATON_FILE, message, place, hint="write `automaton NAME: file.hoa`")
            )
        return Property(line.name, line.kind, file, place, None, {}, file=file)
    if line.kind in ("enforce", "forbid", "forbid initially"):
        if "regular" not in features:
            message = f"this command takes only formulas of temporal logic, not regular properties (`{line.kind}`)"
            hint = "write it as a formula, or check it with `llfsm verify`"
            raise DiagnosticError(Diagnostic(codes.REGULAR, message, text.span(*line.header), hint=hint))
        from llfsm_verify.logic.expressions import nullable
        from llfsm_verify.logic.parsing.regular import parse_regular

        parsed = parse_regular(words)
        if line.kind != "enforce" and nullable(parsed.formula):
            message = f"the empty word matches this, and `{line.kind}` would forbid everything"
            hint = "write `+` instead of `*` where something has to happen"
            raise DiagnosticError(Diagnostic(codes.REGULAR_EMPTY, message, place, hint=hint))
        return Property(line.name, line.kind, words.text(0, last), place, None, parsed.atoms, parsed.formula)
    written = words.text(0, last)
    bounds: tuple[tuple[Span, TimeBound], ...] = ()
    pattern = None
    if syntax == "llfsm":
        pattern = read_pattern(words)
        parsed = parse_words(words) if pattern is None else pattern.parsed
        bounds = tuple(time_bounds(words))
        if pattern is not None:
            written = to_text(parsed.formula)
            bounds += pattern.bounds
    else:
        parsed = parse_in(syntax, _body(line, syntax))
    used = operators(parsed.formula)
    for feature, ops, what in (
        ("past", PAST, "past operators"),
        ("time", TIMED, "bounds in time"),
        ("expressions", BINDING, "regular expressions in a formula"),
    ):
        _refuse_unless(feature in features or not used & ops, what, place)
    formula = without_steps(parsed.formula)
    arrow = any(token.text == "-->" for token in words.tokens)
    doubt = forgotten(parsed.written or parsed.formula, place, name=line.name, arrow=arrow, syntax=syntax)
    if doubt is not None and given is not words and pattern is None:
        own = arrow == any(token.text == "-->" for token in given.tokens)
        doubt = (own and _as_given(given, defined, place, arrow)) or doubt
    return Property(line.name, line.kind, written, place, formula, parsed.atoms, None, None, syntax, bounds, doubt)


def _as_given(words: Words, defined: Definitions, place: Span, arrow: bool) -> Diagnostic | None:
    """W302 that has the names of definitions and families in it; None: without what they stand for it is no formula."""
    names: dict[str, Formula] = {}
    try:
        parsed = parse_words(words)
        for key, fragment in parsed.atoms.items():
            word = Words(fragment, tokenise(key))
            meant = defined.written_out(word, {})
            if meant is not word:
                body = parse_words(meant)
                names[key] = body.written or body.formula
    except DiagnosticError:
        return None
    return forgotten(parsed.written or parsed.formula, place, arrow=arrow, names=names)


def _refuse_unless(fine: bool, what: str, place: Span) -> None:
    if not fine:
        raise DiagnosticError(Diagnostic(codes.UNTRANSLATED, f"this command does not take {what}", place))


def _duplicate(line: Line, span: Span, first: Span, first_named: bool) -> Diagnostic:
    if line.named and first_named:
        return Diagnostic(
            codes.DUPLICATE_NAME, f"there are two properties `{line.name}`", span, (f"the other one is at {first}",)
        )
    message = f"a formula without a name is named after its line, but `{line.name}` is the name of another one"
    return Diagnostic(
        codes.DUPLICATE_NAME, message, span, (f"the other one is at {first}",), hint="write `NAME:` before the formula"
    )


def asked_text(kind: str, text: str) -> str:
    """A property as it was written, without its name: `forbid a b`, never `a b`, which would say the contrary."""
    return text if kind == "ltl" else f"{kind} {text}"
