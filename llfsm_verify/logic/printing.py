"""Formulas as text in the syntax of property files, with the parentheses that reading them back needs."""

from __future__ import annotations

import re

from llfsm_verify.logic.bounds import repetition
from llfsm_verify.logic.formula import EXPRESSIONS, STEPS, TIMED, Formula, Op
from llfsm_verify.logic.quoting import needs_quotes

_LEVEL: dict[Op, int] = {
    "iff": 1, "implies": 2, "or": 3, "xor": 4, "and": 5,
    "U": 6, "W": 6, "R": 6, "M": 6, "S": 6, "T": 6, "U<=": 6,
    "not": 7, "X": 7, "F": 7, "G": 7, "Y": 7, "Z": 7, "O": 7, "H": 7,
    "X[]": 7, "F[]": 7, "G[]": 7, "F<=": 7, "G<=": 7, "atom": 8, "true": 8, "false": 8,
}  # fmt: skip
"""How tightly an operator binds (the levels of grammar.lark)."""

_SIGN: dict[Op, str] = {"and": " && ", "or": " || ", "xor": " xor ", "implies": " -> ", "iff": " <-> "}


def to_text(f: Formula, limit: int | None = None) -> str:
    """`f` as `parse_formula` reads it. `limit`: stop after about that many characters, with an ellipsis."""
    pieces: list[str] = []
    length = 0
    stack: list[Formula | str] = [f]
    while stack:
        top = stack.pop()
        if isinstance(top, str):
            pieces.append(top)
            length += len(top)
            if limit is not None and length > limit:
                pieces.append("…")
                break
        else:
            stack.extend(reversed(_parts(top)))
    return "".join(pieces)


def _parts(f: Formula) -> list[Formula | str]:
    if f.op not in _LEVEL:
        return list(_regular(f))
    if f.op == "atom":
        return [f'"{f.key}"' if needs_quotes(f.key) else f.key]
    if not f.args:
        return [f.op]
    if len(f.args) == 1:
        (a,) = f.args
        sign = "!" if f.op == "not" else f"{written(f)} "
        # An atom of several words would read back without parentheses too, but `!x == 3` misleads people.
        if _LEVEL.get(a.op, 0) < 7 or (a.op == "atom" and " " in a.key and not needs_quotes(a.key)):
            return [sign, "(", a, ")"]
        return [sign, a]
    parts: list[Formula | str] = []
    for i, a in enumerate(f.args):
        if i:
            parts.append(_SIGN.get(f.op, f" {written(f)} "))
        parts += [a] if _LEVEL.get(a.op, 0) > _LEVEL[f.op] else ["(", a, ")"]
    return parts


def written(f: Formula) -> str:
    """The operator of `f` with its bound: `U`, `F[2:5]`, `G[<=500ms]`."""
    if f.op in TIMED:
        return f"{f.op[0]}[<={f.key}ms]"
    return f"{f.op[0]}[{f.key}]" if f.op in STEPS else f.op


def _regular(f: Formula) -> list[Formula | str]:
    """Regular expressions in the syntax of `enforce` and `forbid`; what that lacks stands there by its name."""
    args = f.args
    if f.op in ("seq", "alt"):
        parts: list[Formula | str] = ["("]
        for i, a in enumerate(args):
            parts += [*([" | " if f.op == "alt" else " "] if i else []), *_piece(a)]
        return [*parts, ")"]
    if f.op == "repeat":
        low, high = repetition(f)
        simple = {(0, None): "*", (1, None): "+", (0, 1): "?", (low, low): f"{{{low}}}"}
        return [*_piece(args[0]), simple.get((low, high), f"{{{low},{'' if high is None else high}}}")]
    if f.op == "empty":
        return ["true{0}"]
    pieces: list[Formula | str] = [f"{f.op}("]
    for i, a in enumerate(args):
        pieces += [*([", "] if i else []), *_piece(a)]
    return [*pieces, ")"]


def _piece(f: Formula) -> list[Formula | str]:
    """A part of a regular expression: letters are bracketed unless they are one word."""
    if f.op == "repeat":
        return ["(", f, ")"]
    if f.op in EXPRESSIONS or f.op == "true" or (f.op == "atom" and not needs_quotes(f.key) and _WORD.match(f.key)):
        return [f]
    return ["[", f, "]"]


_WORD = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*(?:@[A-Za-z_]\w*)?\Z")
"""The atoms that are letters without brackets."""
