"""The words of the Hanoi Omega-Automata format, version 1."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.logic import codes


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
    source: Source, message: str, start: int, end: int, code: str = codes.HOA, hint: str | None = None
) -> DiagnosticError:
    """A mistake in the characters `start` to `end`."""
    return DiagnosticError(Diagnostic(code, message, Span(source, start, end), hint=hint))
