"""The logical lines of a property file: one property each, with its name and kind, and which lines go on."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.definitions import ends_family, is_family
from llfsm_verify.logic.parsing.tokens import BINARY, CLOSING, OPENING, PREFIX, Token
from llfsm_verify.logic.parsing.words import Words

Kind = Literal["ltl", "assume", "enforce", "forbid", "forbid initially", "automaton", "automaton never"]

_KIND = r"(assume|enforce|forbid(?:[ \t]+initially)?|automaton(?:[ \t]+never)?)"
_HEADER = re.compile(rf"(?:{_KIND}[ \t]+)?([A-Za-z_][A-Za-z0-9_-]*)[ \t]*:(?!=)")
_KIND_WORD = re.compile(rf"{_KIND}\b")
_TWO_WORDS = re.compile(r"([A-Za-z_]+)[ \t]+([A-Za-z_]+)(?:[ \t]+[A-Za-z_][A-Za-z0-9_-]*)?[ \t]*:(?!=)")

_AFTER_NAME = (PREFIX - {"NOT"}) | {"ASSIGN", "LSQB", "LPAR"}
"""What follows the name of a line where the colon is missing, rather than its first operand."""
_GOES_ON = BINARY | PREFIX | {"COMMA", "DOT", "AT", "COLON", "QUESTION"}
_GOES_ON_REGULAR = frozenset({"OR", "COLON", "COMMA"})
"""`*`, `+` and `?` end a regular expression."""


@dataclass(frozen=True, slots=True)
class Line:
    """A property as it stands in the file: `body` are the words after ``name:`` (none: no formula)."""

    kind: Kind
    name: str
    named: bool
    """The user gave the name."""
    header: tuple[int, int]
    """The characters of kind and name (of the whole formula when there is no name)."""
    body: Words


def has_header(text: str, start: int = 0) -> bool:
    """Whether ``name:`` stands at `start`, with or without a kind, or what is meant to be one, before it."""
    property_ = _HEADER.match(text, start) is not None or _TWO_WORDS.match(text, start) is not None
    return property_ or is_family(text, start)


def logical_lines(text: Fragment, tokens: list[Token], starts: Sequence[int] = ()) -> Iterator[list[Token]]:
    """The tokens of each property.

    A line goes on when it ends in an operator or inside brackets, unless the next line starts with ``name:``, which no
    formula contains: then the mistake is in the line before. None goes on beyond one of `starts`, ascending offsets.
    """
    current: list[Token] = []
    brackets = 0
    start_of_line = True
    for token in tokens:
        if token.type == "NEWLINE":
            start_of_line = True
            continue
        if start_of_line and current:
            head = ends_family(text.text, current)
            goes_on = head or brackets > 0 or current[-1].type in _ends_open(text.text, current)
            apart = bisect_right(starts, token.start) > bisect_right(starts, current[-1].start)
            if not goes_on or apart or (has_header(text.text, token.start) and not head):
                yield current
                current, brackets = [], 0
        start_of_line = False
        current.append(token)
        if token.type in OPENING:
            brackets += 1
        elif token.type in CLOSING:
            brackets = max(0, brackets - 1)
    if current:
        yield current


def _ends_open(text: str, line: list[Token]) -> frozenset[str] | set[str]:
    match = _HEADER.match(text, line[0].start)
    if match is not None and match[1] is not None and match[1] != "assume":
        return frozenset() if match[1].startswith("automaton") else _GOES_ON_REGULAR
    if len(line) > 1 and line[-2].type in ("DOT", "AT"):
        return frozenset()  # the name of a state or field
    return _GOES_ON


def read_line(text: Fragment, tokens: list[Token]) -> Line:
    """Kind, name and body of one logical line; DiagnosticError E311 or E312 when the name is wrong."""
    first, last = tokens[0], tokens[-1]
    match = _HEADER.match(text.text, first.start)
    if match is not None:
        kind, name = match[1], match[2]
        if kind is None and _KIND_WORD.fullmatch(name):
            raise _nameless(text, tokens, name)
        if (kind, name.lower()) in (("forbid", "initially"), ("automaton", "never")):
            if not name.islower():
                raise _misspelt(text, match.span(2), f"{kind} {name}", f"{kind} {name.lower()}")
            raise _nameless(text, tokens, f"{kind} {name}")
        body = [t for t in tokens if t.start >= match.end()]
        if kind is None and body:
            _refuse_late_kind(text, name, body)
        written = cast(Kind, " ".join(kind.split()) if kind else "ltl")
        return Line(written, name, True, (match.start(), match.end(2)), Words(text, body))
    _refuse_unknown_kind(text, tokens)
    word = _KIND_WORD.match(text.text, first.start)
    if word is not None and first.type == "NAME":
        follows = tokens[len(word[1].split())] if len(tokens) > len(word[1].split()) else None
        if follows is None or follows.type not in BINARY - {"MINUS"} | {"DOT", "AT"}:
            raise _nameless(text, tokens, " ".join(word[1].split()))
    _refuse_colon(text, tokens)
    line = text.span(first.start, last.end).line
    return Line("ltl", f"L{line}", False, (first.start, last.end), Words(text, tokens))


def _refuse_late_kind(text: Fragment, name: str, body: list[Token]) -> None:
    """DiagnosticError (E312) when the kind of a property follows its name, as in reports."""
    word = _KIND_WORD.match(text.text, body[0].start)
    if word is None:
        return
    kind = " ".join(word[1].split())
    rest = body[len(kind.split()) :]
    if not rest or rest[0].type in BINARY - {"MINUS"} | {"DOT", "AT"}:
        return
    if [t.type for t in rest[:3]] in (["LSQB", "NUMBER", "RSQB"], ["LSQB", "MINUS", "NUMBER"]):
        return  # an element of an array of that name
    message = f"`{kind}` belongs before the name of a property"
    hint = f"write `{kind} {name}: {Words(text, rest).rest(0)}`"
    raise DiagnosticError(Diagnostic(codes.BAD_NAME, message, text.span(*word.span(1)), hint=hint))


def _nameless(text: Fragment, tokens: list[Token], kind: str) -> DiagnosticError:
    span = text.span(tokens[0].start, tokens[0].end)
    message = f"`{kind}` needs a name: `{kind} NAME: …`"
    name, first = "NAME", len(kind.split())
    first += [t.type for t in tokens[first : first + 1]] == ["COLON"]
    given, sign = ([t.type for t in tokens[first : first + 2]] + [""] * 2)[:2]
    named = sign in _AFTER_NAME or (sign == "NAME" and kind.startswith("a"))  # letters have no sign between them
    if given == "NAME" and named:
        name, first = tokens[first].text, first + 1 + (sign == "ASSIGN")
    hint = f"write `{kind} {name}: {Words(text, tokens).rest(first)}`"
    hint += f', or `"{kind}"` for a variable of that name' if " " not in kind else ""
    return DiagnosticError(Diagnostic(codes.NAME_MISSING, message, span, hint=hint))


_SYNONYMS = {
    "ensure": "enforce", "require": "enforce", "force": "enforce", "must": "enforce",
    "prohibit": "forbid", "disallow": "forbid", "suppose": "assume", "assumption": "assume",
    "initial": "initially", "first": "initially",
}  # fmt: skip


def kind_meant(word: str, kinds: Sequence[str] = ("assume", "enforce", "forbid", "automaton")) -> str | None:
    """The kind of property, one of `kinds`, that `word` is a misspelling of; None: it is like none of them."""
    from difflib import get_close_matches

    lower = word.lower()
    near = get_close_matches(_SYNONYMS.get(lower, lower), kinds, 1, 0.8)
    return near[0] if near else None


def _refuse_unknown_kind(text: Fragment, tokens: list[Token]) -> None:
    """DiagnosticError (E312) when `Enforce x:`, `ensure x:` or `forbid Initially x:` starts the line."""
    match = _TWO_WORDS.match(text.text, tokens[0].start)
    if match is None:
        return
    if match[1] == "initially":
        message = "`initially` is not a kind of property: it stands before a formula"
        head, body = match[0].removeprefix("initially").strip(), [t for t in tokens if t.start >= match.end()]
        start = "" if head.startswith(("forbid", "enforce")) else "initially "
        head = re.sub(r"\Aforbid\b", "forbid initially", head)
        span, hint = text.span(*match.span(1)), f"write `{head} {start}{Words(text, body).rest(0)}`"
        raise DiagnosticError(Diagnostic(codes.BAD_NAME, message, span, hint=hint))
    kind = kind_meant(match[1])
    if kind is not None and kind != match[1]:
        raise _misspelt(text, match.span(1), match[1], kind)
    second = {"forbid": "initially", "automaton": "never"}.get(match[1])
    if second is not None:
        meant = kind_meant(match[2], (second,))
        if meant is not None:
            raise _misspelt(text, match.span(2), f"{match[1]} {match[2]}", f"{match[1]} {meant}")


def _misspelt(text: Fragment, place: tuple[int, int], word: str, meant: str) -> DiagnosticError:
    message = f"`{word}` is not a kind of property; did you mean `{meant}`?"
    hint = "the kinds are `assume`, `enforce`, `forbid`, `forbid initially`, `automaton` and `automaton never`"
    return DiagnosticError(Diagnostic(codes.BAD_NAME, message, text.span(*place), hint=hint))


def _refuse_colon(text: Fragment, tokens: list[Token]) -> None:
    depth = 0
    for i, token in enumerate(tokens):
        depth += (token.type in OPENING) - (token.type in CLOSING)
        if token.type == "QUESTION":
            return  # a conditional expression: the formula's own diagnostic says more
        if token.type == "COLON" and depth <= 0:
            span = text.span(tokens[0].start, tokens[max(0, i - 1)].end)
            if i == 0:
                message, hint = "there is no name before `:`", "write `NAME: formula`"
            else:
                message = "the text before `:` is not a valid name of a property"
                hint = "a name is one word of letters, digits, `_` and `-`, and starts with a letter or `_`"
            raise DiagnosticError(Diagnostic(codes.BAD_NAME, message, span, hint=hint))
