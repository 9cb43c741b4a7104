"""`define NAME: …` and `for l in {ns, ew}: …`: words that stand for others, written out before a formula is read.

    define moving: drive != HALT
    safe: G (moving -> door == CLOSED)
    for l in {ns, ew}: served: G F l@GREEN

A definition holds in its whole file, also before it; a bare name that is one stands for its words, in parentheses
where they are several. A family is a property for each value of its names, called `served_ns` and `served_ew`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.tokens import KEYWORDS, MAX_TOKENS, OF_STATES, Token, tokenise
from llfsm_verify.logic.parsing.words import Words, check_words

MAX_FAMILY = 1_000
"""The most properties that one family has."""
MAX_RANGE = 1_000
"""The most values of a range in a family."""
_DEFINE = re.compile(r"define[ \t]+([A-Za-z_][A-Za-z0-9_]*)[ \t]*:(?!=)")
_FOR = re.compile(r"for[ \t]+[A-Za-z_][A-Za-z0-9_]*[ \t]+in\b")
_COMMENT = re.compile(r"#[^\n]*")
_LOOP = re.compile(r"\s*([A-Za-z_]\w*)\s+in\s*(?:\{([^{}]*)\}|([0-9]{1,9})\s*\.\.\s*([0-9]{1,9}))\s*([,:])", re.ASCII)
_VALUE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*|[0-9]{1,9}", re.ASCII)
_NO_VALUE = re.compile(r"[-+][ ]?[0-9]+(?:\.[0-9]+)?|[0-9]+\.[0-9]+", re.ASCII)
_NUMBERS = "values are names and numbers from 0 on, without a point: write these properties one by one"
_HINT = "write `for l in {ns, ew}: name: formula`, or `for i in 0..3: …`"


def is_definition(text: str, start: int) -> bool:
    """Whether ``define NAME:`` stands at `start`."""
    return _DEFINE.match(text, start) is not None


def is_family(text: str, start: int) -> bool:
    """Whether ``for NAME in`` stands at `start`."""
    return _FOR.match(text, start) is not None


def ends_family(text: str, line: Sequence[Token]) -> bool:
    """Whether a line is the head of a family alone, so that the next one belongs to it."""
    return line[-1].type == "COLON" and is_family(text, line[0].start) and _head(text, line)[1] == line[-1].end


def _head(text: str, line: Sequence[Token]) -> tuple[list[tuple[str, list[str], int]], int | None]:
    """The names of a family with their values and places, and where its head ends; None: it is wrong."""
    start = line[0].start
    head = _COMMENT.sub(lambda comment: " " * len(comment[0]), text[start : line[-1].end])
    at = len("for")
    loops: list[tuple[str, list[str], int]] = []
    while True:
        match = _LOOP.match(head, at)
        if match is None:
            return loops, None
        if match[2] is not None:
            values = [value.strip() for value in match[2].split(",")]
        else:
            first, last = int(match[3]), int(match[4])
            values = [str(i) for i in range(first, min(last, first + MAX_RANGE) + 1)]
        loops.append((match[1], values, start + match.start(1)))
        at = match.end()
        if match[5] == ":":
            return loops, start + at


@dataclass(frozen=True, slots=True)
class Member:
    """One property of a family: the words that its names stand for, and what is put after its own name."""

    values: Mapping[str, str] = field(default_factory=dict)
    suffix: str = ""


def family(text: Fragment, line: list[Token]) -> tuple[dict[str, Span], list[Member], list[Token]]:
    """The names of a family that stand for others with their places, its members, and the words after its head.

    DiagnosticError (E318): the head is wrong."""
    loops, end = _head(text.text, line)
    place = text.span(line[0].start, line[0].end)
    if end is None:
        message, hint = "this does not say which values the names have", _HINT
        number = _NO_VALUE.search(text.text, line[0].start, line[min(9, len(line) - 1)].start)
        if number is not None:
            message, hint, place = f"`{number[0]}` is not a value of a family", _NUMBERS, text.span(*number.span())
        raise DiagnosticError(Diagnostic(codes.FAMILY, message, place, hint=hint))
    size = 1
    for name, values, at in loops:
        size *= len(values)
        span = text.span(at, at + len(name))
        if name in KEYWORDS:
            message = f"`{name}` is a word of formulas"
            raise DiagnosticError(Diagnostic(codes.FAMILY, message, span, hint="choose another name"))
        wrong = next((v for v in values if not _VALUE.fullmatch(v)), None)
        if wrong is not None:
            message = f"`{wrong[:40]}` is not a name or a number" if wrong else "a value is missing between the commas"
            begin = text.text.find(wrong, at + len(name))
            span = text.span(begin, begin + len(wrong)) if wrong else span
            hint = _NUMBERS if _NO_VALUE.fullmatch(wrong) else _HINT
            raise DiagnosticError(Diagnostic(codes.FAMILY, message, span, hint=hint))
        if len(set(values)) < len(values):
            raise DiagnosticError(Diagnostic(codes.FAMILY, f"`{name}` has a value twice", span, hint="remove one"))
        if not values or size > MAX_FAMILY:
            message = f"this is more than {MAX_FAMILY:,} properties" if values else "a range ends before it starts"
            hint = "write smaller families" if values else "write the smaller number first"
            raise DiagnosticError(Diagnostic(codes.FAMILY, message, span, hint=hint))
    names = [name for name, _, _ in loops]
    if len(set(names)) < len(names):
        message = "two names of a family are the same"
        raise DiagnosticError(Diagnostic(codes.FAMILY, message, place, hint="choose another name"))
    rest = [t for t in line if t.start >= end]
    if not rest:
        raise DiagnosticError(Diagnostic(codes.FAMILY, "no property follows this", place, hint=_HINT))
    members = [
        Member(dict(zip(names, values, strict=True)), "".join(f"_{v}" for v in values))
        for values in product(*(values for _, values, _ in loops))
    ]
    places = {name: text.span(at, at + len(name)) for name, values, at in loops if values != [name]}
    return places, members, rest


class Definitions:
    """The definitions of one property file."""

    def __init__(self) -> None:
        self._bodies: dict[str, Words] = {}
        self._places: dict[str, Span] = {}
        self._written: dict[str, Fragment] = {}

    def add(self, text: Fragment, line: list[Token]) -> None:
        """Keep a line ``define NAME: …``. DiagnosticError (E317): the name is taken, or nothing follows it."""
        match = _DEFINE.match(text.text, line[0].start)
        assert match is not None
        name, place = match[1], text.span(*match.span(1))
        if name in self._bodies:
            message = f"there are two definitions of `{name}`"
            notes = (f"the other one is at {self._places[name]}",)
            raise DiagnosticError(Diagnostic(codes.DEFINITION, message, place, notes, hint="choose another name"))
        if name in KEYWORDS:
            message = f"`{name}` is a word of formulas"
            raise DiagnosticError(Diagnostic(codes.DEFINITION, message, place, hint="choose another name"))
        body = [t for t in line if t.start >= match.end()]
        if not body:
            message = f"there is nothing after `define {name}:`"
            raise DiagnosticError(Diagnostic(codes.DEFINITION, message, place, hint="write what it stands for"))
        check_words(Words(text, body))
        self._bodies[name], self._places[name] = Words(text, body), place

    def places(self) -> dict[str, Span]:
        """Where each name is defined."""
        return dict(self._places)

    def written_out(self, words: Words, values: Mapping[str, str]) -> Words:
        """`words` with what names stand for; the same object, where no such name is there.

        DiagnosticError (E317, E305): a definition leads back to itself, or what it stands for is too long.
        """
        if not any(t.type == "NAME" and (t.text in values or t.text in self._bodies) for t in words.tokens):
            return words
        fragment = self._expand(words, values, ())
        return Words(fragment, [t for t in tokenise(fragment.text) if t.type != "NEWLINE"], words)

    def _expand(self, words: Words, values: Mapping[str, str], inside: tuple[str, ...]) -> Fragment:
        """The words on one line, each name replaced by what it stands for."""
        tokens = words.tokens
        in_states = False
        text: list[str] = []
        offsets: list[int] = []
        places = words.fragment.offsets
        for i, token in enumerate(tokens):
            start, end = places[token.start], places[token.end - 1] + 1
            opens = token.type == "LBRACE" and i > 0 and tokens[i - 1].type == "AT"
            in_states = opens or (in_states and token.type != "RBRACE")
            if i and tokens[i - 1].end < token.start:
                text.append(" ")
                offsets.append(start)
            if token.type == "NAME" and token.text in values:
                text.append(values[token.text])
                offsets += [start] * (len(values[token.text]) - 1) + [end - 1]
            elif not in_states and self._stands(tokens, i):
                body = self._body(token.text, words.fragment.span(token.start, token.end), inside)
                around = i > 0 and i + 1 < len(tokens) and (tokens[i - 1].type, tokens[i + 1].type) == ("LPAR", "RPAR")
                single = around or len(tokenise(body.text, limit=1)) == 1
                text += [body.text] if single else ["(", body.text, ")"]
                own = list(body.offsets[: len(body.text)])
                offsets += own if single else [start, *own, end - 1]
            else:
                text.append(token.text)
                offsets += places[token.start : token.end]
            if len(offsets) > 20 * MAX_TOKENS:
                message = "the text that the definitions produce is too long"
                span = words.fragment.span(token.start, token.end)
                raise DiagnosticError(Diagnostic(codes.TOO_MANY_WORDS, message, span))
        return Fragment("".join(text), words.fragment.source, (*offsets, offsets[-1] + 1))

    def _stands(self, tokens: list[Token], i: int) -> bool:
        """Whether a word outside ``@{…}`` is a bare name that is defined: no state, field, function or machine."""
        token = tokens[i]
        if token.type != "NAME" or token.text not in self._bodies:
            return False
        before = tokens[i - 1].type if i else ""
        after = tokens[i + 1].type if i + 1 < len(tokens) else ""
        of_machine = i > 2 and before == "LPAR" and tokens[i - 2].text in OF_STATES and tokens[i - 3].type == "DOT"
        apart = before not in ("DOT", "AT") and after not in ("DOT", "AT", "LPAR", "LSQB")
        return apart and not of_machine

    def _body(self, name: str, place: Span, inside: tuple[str, ...]) -> Fragment:
        if name in inside:
            message = f"`{name}` is defined by itself: {' → '.join((*inside[inside.index(name) :], name))}"
            raise DiagnosticError(Diagnostic(codes.DEFINITION, message, place, hint="write one of them out"))
        found = self._written.get(name)
        if found is None:
            found = self._expand(self._bodies[name], {}, (*inside, name))
            self._written[name] = found
        return found
