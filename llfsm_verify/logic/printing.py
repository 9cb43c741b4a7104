"""Formulas as text in the syntax of property files, with the parentheses that reading them back needs."""

from __future__ import annotations

from llfsm_verify.logic.formula import Formula, Op
from llfsm_verify.logic.quoting import needs_quotes

_LEVEL: dict[Op, int] = {
    "iff": 1, "implies": 2, "or": 3, "xor": 4, "and": 5, "U": 6, "W": 6, "R": 6, "M": 6,
    "not": 7, "X": 7, "F": 7, "G": 7, "atom": 8, "true": 8, "false": 8,
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
    if f.op == "atom":
        return [f'"{f.key}"' if needs_quotes(f.key) else f.key]
    if not f.args:
        return [f.op]
    if len(f.args) == 1:
        (a,) = f.args
        sign = "!" if f.op == "not" else f"{f.op} "
        # An atom of several words would read back without parentheses too, but `!x == 3` misleads people.
        if _LEVEL[a.op] < 7 or (a.op == "atom" and " " in a.key and not needs_quotes(a.key)):
            return [sign, "(", a, ")"]
        return [sign, a]
    parts: list[Formula | str] = []
    for i, a in enumerate(f.args):
        if i:
            parts.append(_SIGN.get(f.op, f" {f.op} "))
        parts += [a] if _LEVEL[a.op] > _LEVEL[f.op] else ["(", a, ")"]
    return parts
