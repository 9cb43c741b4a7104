"""The words of the Hanoi Omega-Automata format, version 1, and its acceptance conditions that are generalised Büchi."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.plug import WRONG_HOA as HOA
from llfsm_verify.plug import Source, Span


class Token(NamedTuple):
    """A word of kind HEADER (`States:`), IDENT, ALIAS (`@a`), INT, STRING (without quotes and escapes), SIGN, MARK."""

    kind: str
    text: str
    start: int
    end: int


_TOKEN = re.compile(
    r"""
    (?P<SKIP>\s+)
  | (?P<COMMENT>/\*)
  | (?P<MARK>--BODY--|--END--|--ABORT--)
  | (?P<HEADER>[A-Za-z_][A-Za-z0-9_.-]*:)
  | (?P<ALIAS>@[A-Za-z0-9_-]+)
  | (?P<IDENT>[A-Za-z_][A-Za-z0-9_.-]*)
  | (?P<INT>0|[1-9][0-9]{0,9}(?![0-9]))
  | (?P<STRING>"(?:[^"\\]|\\.)*")
  | (?P<SIGN>[\[\]{}()&|!])
    """,
    re.VERBOSE | re.DOTALL,
)
_COMMENT = re.compile(r"/\*|\*/")


def tokens(source: Source) -> Iterator[Token]:
    """The words of `source`, comments (which may stand inside each other) left out; DiagnosticError (E360)."""
    text, at = source.text, 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            message = '`"` opens a string that is not closed' if text[at] == '"' else "no word of this format"
            raise wrong(source, message, at, at + 1)
        kind, word = match.lastgroup or "", match.group()
        end = match.end()
        if kind == "COMMENT":
            end = _comment_end(source, at)
        elif kind == "STRING":
            yield Token(kind, re.sub(r"\\(.)", r"\1", word[1:-1], flags=re.DOTALL), at, end)
        elif kind != "SKIP":
            yield Token(kind, word, at, end)
        at = end


def _comment_end(source: Source, start: int) -> int:
    depth = 0
    for match in _COMMENT.finditer(source.text, start):
        depth += 1 if match.group() == "/*" else -1
        if depth == 0:
            return match.end()
    raise wrong(source, "this comment is not closed", start, start + 2)


def wrong(
    source: Source, message: str, start: int, end: int, code: str = HOA, hint: str | None = None
) -> DiagnosticError:
    """A mistake in the characters `start` to `end`."""
    return DiagnosticError(Diagnostic(code, message, Span(source, start, end), hint=hint))


MAX_SETS = 1_000


@dataclass(frozen=True, slots=True)
class Acceptance:
    """A condition over `sets` sets, at the characters `start` to `end` of the file.

    `inf` are the sets to be visited infinitely often, each with whether its complement is meant; None: the condition
    says something else. `never`: it is `f`.
    """

    sets: int
    inf: tuple[tuple[int, bool], ...] | None
    never: bool
    text: str
    start: int
    end: int

    def marks(self, sets: int) -> int:
        """The acceptance of a transition in the file's sets `sets` (a mask): bit k is element k of `inf`."""
        return sum(1 << k for k, (i, complement) in enumerate(self.inf or ()) if bool(sets >> i & 1) != complement)


def read_acceptance(source: Source, words: Sequence[Token], at: int) -> tuple[Acceptance, int]:
    """The condition of `Acceptance:`, whose first word is number `at`, and the number of the word after it."""
    start = at

    def word(kind: str, text: str | None, what: str) -> Token:
        nonlocal at
        if at >= len(words) or words[at].kind != kind or (text is not None and words[at].text != text):
            here = words[min(at, len(words) - 1)]
            raise wrong(source, f"{what} is expected here", here.start, here.end)
        at += 1
        return words[at - 1]

    def is_sign(*texts: str) -> bool:
        return at < len(words) and words[at].kind == "SIGN" and words[at].text in texts

    count = word("INT", None, "the number of acceptance sets")
    sets = int(count.text)
    if sets > MAX_SETS:
        raise wrong(source, f"more than {MAX_SETS:,} acceptance sets", count.start, count.end)
    inf: dict[tuple[int, bool], None] = {}
    simple, never, depth = True, False, 0
    while True:
        while is_sign("("):
            at, depth = at + 1, depth + 1
        primitive = word("IDENT", None, "`Inf(…)`, `Fin(…)`, `t` or `f`")
        if primitive.text in ("Inf", "Fin"):
            word("SIGN", "(", "`(`")
            complement = is_sign("!")
            at += complement
            number = word("INT", None, "the number of an acceptance set")
            if int(number.text) >= sets:
                are = "is 1 acceptance set" if sets == 1 else f"are {sets} acceptance sets"
                raise wrong(source, f"there {are}, counted from 0", number.start, number.end)
            word("SIGN", ")", "`)`")
            inf[int(number.text), complement] = None
            simple = simple and primitive.text == "Inf"
        elif primitive.text == "f":
            never = True
        elif primitive.text != "t":
            raise wrong(source, "`Inf(…)`, `Fin(…)`, `t` or `f` is expected here", primitive.start, primitive.end)
        while depth and is_sign(")"):
            at, depth = at + 1, depth - 1
        if is_sign("&", "|"):
            simple = simple and words[at].text == "&"
            at += 1
            continue
        if depth:
            word("SIGN", ")", "`)`")
        break
    first, last = words[start].start, words[at - 1].end
    text = source.text[words[start + 1].start : last]
    if never and not simple:
        never = False
    return Acceptance(sets, tuple(inf) if simple else None, never, text, first, last), at
