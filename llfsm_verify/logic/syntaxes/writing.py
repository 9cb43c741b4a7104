"""Formulas as text in any syntax: all in parentheses, and atoms quoted where their spelling means something else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol, cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import without_bounded_since, without_steps
from llfsm_verify.logic.formula import (
    BINDING,
    EXPRESSIONS,
    PAST_STEPS,
    STEPS,
    TIMED,
    Formula,
    Op,
    mapped,
    repetition,
    written,
)
from llfsm_verify.logic.parsing.tokens import needs_quotes
from llfsm_verify.logic.syntax_names import OURS, TABLES

MAX_TEXT = 4 << 20
"""A text that would be longer, because a formula shares its parts and a text cannot, is refused."""

Pieces = list["Formula | str"]


@dataclass(frozen=True, slots=True)
class Spelling:
    """How a syntax writes operators, constants and atoms, and what it says by others."""

    title: str
    prefix: Mapping[Op, str]
    infix: Mapping[Op, str]
    true: str
    false: str
    atom: Callable[[str], str]
    instead: Mapping[Op, Callable[..., Formula]]
    steps: Callable[[Formula], str] | None = None
    """The operator with a step bound; None: bounds are written out."""
    bounds: bool = False
    """There are operators with a bound in time, and of the past with one in steps, written as `written` does."""
    expressions: bool = False


class _Spelled(Protocol):
    """As much of a syntax as is needed here."""

    @property
    def spelling(self) -> Spelling: ...


def write_formula(syntax: str, formula: Formula, limit: int | None = None) -> str:
    """`formula` in `syntax`; DiagnosticError (E352): it lacks an operator. LimitReached: the text is too long.

    `limit`: stop after about that many characters, with an ellipsis.
    """
    spelling = OURS_SPELLING if syntax == OURS else cast(_Spelled, TABLES.load(syntax)).spelling
    formula = _said(spelling, formula if spelling.steps else without_steps(formula))
    if not spelling.bounds and "O" in spelling.prefix:
        formula = without_bounded_since(formula)
    pieces: list[str] = []
    length = 0
    stack: list[Formula | str] = [formula]
    while stack:
        top = stack.pop()
        if isinstance(top, str):
            pieces.append(top)
            length += len(top)
            if limit is not None and length > limit:
                pieces.append("…")
                break
            if length > MAX_TEXT:
                message = f"the formula is longer than {MAX_TEXT >> 20} MiB when its shared parts are written out"
                raise LimitReached(message)
        else:
            stack.extend(reversed(_pieces(spelling, top)))
    text = "".join(pieces)
    return (
        text[1:-1]
        if text.startswith("(")
        and text.endswith(")")
        and formula.op in {*spelling.infix, *BINDING, *TIMED, *PAST_STEPS}
        else text
    )


def _said(spelling: Spelling, formula: Formula) -> Formula:
    """`formula` with the operators that the syntax lacks said by others."""
    return mapped(formula, lambda f, args: spelling.instead[f.op](*args) if f.op in spelling.instead else None)


def _pieces(spelling: Spelling, f: Formula) -> Pieces:
    if f.op in ("true", "false"):
        return [spelling.true if f.op == "true" else spelling.false]
    if f.op == "atom":
        return [spelling.atom(f.key)]
    if spelling.steps and (f.op in STEPS or (f.op in ("O[]", "H[]") and "O" in spelling.prefix)):
        return [spelling.steps(f), "(", f.args[0], ")"]
    if spelling.bounds and f.op in TIMED | PAST_STEPS:
        sign = f"{written(f)} "
        return ["(", f.args[0], f" {sign}", f.args[1], ")"] if len(f.args) == 2 else [sign, "(", f.args[0], ")"]
    if f.op in spelling.prefix:
        sign = spelling.prefix[f.op]
        bare = f.args[0].op in ("atom", "true", "false") and not sign[-1].isalnum()
        return (
            [sign, f.args[0]]
            if bare or f.args[0].op in {*spelling.infix, "[]->", "<>->"}
            else [sign, "(", f.args[0], ")"]
        )
    if f.op in spelling.infix:
        parts: Pieces = ["("]
        for i, a in enumerate(f.args):
            parts += [*([f" {spelling.infix[f.op]} "] if i else []), a]
        return [*parts, ")"]
    if spelling.expressions:
        if f.op in ("[]->", "<>->"):
            return ["(", "{", f.args[0], "}", f.op, "(", f.args[1], ")", ")"]
        if f.op == "closure":
            return ["{", f.args[0], "}"]
        if f.op in EXPRESSIONS:
            return _expression(f)
    raise _unsayable(spelling, f)


def _unsayable(spelling: Spelling, f: Formula) -> DiagnosticError:
    if f.op in EXPRESSIONS | BINDING:
        what, hint = "regular expressions inside formulas", "write it in Spot's syntax (`--to spot`)"
    else:
        what = f"operator `{written(f)}`"
        hint = "write it in the syntax of property files (`--to llfsm`)"
    return DiagnosticError(Diagnostic(codes.UNSAYABLE, f"{spelling.title} has no {what}", hint=hint))


_EXPRESSION_SIGNS: Final[dict[Op, str]] = {"seq": ";", "fuse": ":", "alt": "|", "inter": "&&", "nlm": "&"}


def _expression(f: Formula) -> Pieces:
    """An expression in Spot's syntax; braces keep its parts together."""
    if f.op == "empty":
        return ["[*0]"]
    if f.op == "repeat":
        low, high = repetition(f)
        return ["{", f.args[0], "}", f"[*{low}]" if low == high else f"[*{low}..{'' if high is None else high}]"]
    if f.op == "first_match":
        return ["first_match(", f.args[0], ")"]
    parts: Pieces = ["{"]
    for i, a in enumerate(f.args):
        parts += [*([_EXPRESSION_SIGNS[f.op]] if i else []), "{", a, "}"]
    return [*parts, "}"]


# ---------------------------------------------------------------- the spellings


def _ours(key: str) -> str:
    return f'"{key}"' if needs_quotes(key) else f"({key})" if " " in key else key


_PREFIX: Final[dict[Op, str]] = {"not": "!", "X": "X ", "F": "F ", "G": "G "}
_PAST: Final[dict[Op, str]] = {"Y": "Y ", "Z": "Z ", "O": "O ", "H": "H "}
_INFIX: Final[dict[Op, str]] = {"implies": "->", "iff": "<->", "U": "U"}


def _with_bounds(f: Formula) -> str:
    return f"{written(f)} "


OURS_SPELLING: Final = Spelling(
        "a property file",
        {**_PREFIX, **_PAST},
        {**_INFIX, "and": "&&", "or": "||", "xor": "xor", "W": "W", "R": "R", "M": "M", "S": "S", "T": "T"},
        "true", "false", _ours, {}, _with_bounds, bounds=True,
    )  # fmt: skip
"""How property files write formulas."""
