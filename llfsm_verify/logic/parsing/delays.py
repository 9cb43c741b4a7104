"""The cycle delays of Spot's and SVA's expressions, `{a ##2 b}`: not supported, and no comments either."""

from __future__ import annotations

import re
from collections.abc import Sequence

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.tokens import Token

_DELAY = re.compile(r"[ \t]*(##(?:[0-9]+|\[[^\]\n]*\]))")
_PIECE = re.compile(r'"[^"\n]*"|[{}]|(?P<delay>##(?:(?P<number>[0-9]+)|\[(?P<range>[^]}\n]*)\]?))|#[^\n]*')


def refuse_delays(fragment: Fragment) -> None:
    """DiagnosticError (E351) for a delay `##2`, `##[1:3]`, `##[+]` or `##[*]` inside braces.

    Meanings: Spot's temporal logic formulas, section on SERE operators. ``a ##i b`` is ``a ; [*i-1] ; b``, and a
    fusion for 0. Elsewhere `#` starts a comment.
    """
    if "##" not in fragment.text:
        return
    braces = 0
    for piece in _PIECE.finditer(fragment.text):
        sign = piece.group()
        braces = max(0, braces + (sign == "{") - (sign == "}"))
        if piece["delay"] is not None and braces:
            message = f"the delay `{sign[:40]}` is not supported"
            raise DiagnosticError(
                Diagnostic(codes.FOREIGN, message, fragment.span(*piece.span()), hint=f"write {_instead(piece)}")
            )


def refuse_delay_of_sva(fragment: Fragment, line: Sequence[Token]) -> None:
    """DiagnosticError (E351): a comment after a word of `line` begins with `##2` or `##[`, so much would be lost."""
    for token in line:
        if found := _DELAY.match(fragment.text, token.end):
            message = f"`{found[1][:40]}` begins a comment, so what follows would not count"
            hint = "for a delay of SVA write `a b` in a rule, `p && X[1] q` in a formula; for a comment write `# 1`"
            raise DiagnosticError(Diagnostic(codes.FOREIGN, message, fragment.span(*found.span(1)), hint=hint))


def _instead(piece: re.Match[str]) -> str:
    if piece["number"] is not None:
        return _by(*[piece["number"].lstrip("0") or "0"] * 2)
    inside = re.sub(r"\s", "", piece["range"])
    if inside in ("+", "*"):
        return _by("1" if inside == "+" else "0", "$")
    bounds = re.fullmatch(r"([0-9]{1,9})?(?:\.\.|:|,|to)([0-9]{1,9}|\$)?", inside)
    if bounds is None:
        return "`a ; [*1] ; b` for `a ##2 b`"
    return _by(str(int(bounds[1] or 0)), bounds[2] or "$")


def _by(low: str, high: str) -> str:
    """The sequence for a delay of `low` to `high` letters."""
    if (low, high) == ("0", "0"):
        return "`a : b`"
    if (low, high) == ("1", "1"):
        return "`a ; b`"
    if low == "0":
        return "`(a : b) | (a ; b)`" if high == "1" else f"`(a : b) | (a ; [*0..{_less(high)}] ; b)`"
    if low == high:
        return f"`a ; [*{_less(low)}] ; b`"
    return f"`a ; [*{_less(low)}..{_less(high)}] ; b`"


def _less(number: str) -> str:
    return number if number == "$" else str(int(number[:9]) - 1)
