"""Formulas as text in any syntax: all in parentheses, and atoms quoted where their spelling means something else."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import step_bound, without_bounded_since, without_steps
from llfsm_verify.logic.formula import (
    BINDING,
    EXPRESSIONS,
    PAST_STEPS,
    STEPS,
    TIMED,
    Formula,
    Op,
    apply,
    conjunction,
    disjunction,
    mapped,
    negation,
    repetition,
    written,
)
from llfsm_verify.logic.parsing.tokens import needs_quotes
from llfsm_verify.logic.syntaxes.nusmv import NUSMV
from llfsm_verify.logic.syntaxes.spin import SPIN
from llfsm_verify.logic.syntaxes.spot import NAME, RESERVED

MAX_TEXT = 4 << 20
"""A text that would be longer, because a formula shares its parts and a text cannot, is refused."""

Pieces = list["Formula | str"]


@dataclass(frozen=True, slots=True)
class _Spelling:
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


def write_formula(syntax: str, formula: Formula, limit: int | None = None) -> str:
    """`formula` in `syntax`; DiagnosticError (E352): it lacks an operator. LimitReached: the text is too long.

    `limit`: stop after about that many characters, with an ellipsis.
    """
    spelling = SPELLINGS[syntax]
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


def _said(spelling: _Spelling, formula: Formula) -> Formula:
    """`formula` with the operators that the syntax lacks said by others."""
    return mapped(formula, lambda f, args: spelling.instead[f.op](*args) if f.op in spelling.instead else None)


def _pieces(spelling: _Spelling, f: Formula) -> Pieces:
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


def _unsayable(spelling: _Spelling, f: Formula) -> DiagnosticError:
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


def _strong_release(a: Formula, b: Formula) -> Formula:
    return apply("U", b, conjunction((a, b)))


def _weak_until(a: Formula, b: Formula) -> Formula:
    return apply("R", b, disjunction((a, b)))


def _different(a: Formula, b: Formula) -> Formula:
    return negation(apply("iff", a, b))


def _ours(key: str) -> str:
    return f'"{key}"' if needs_quotes(key) else f"({key})" if " " in key else key


def _spot_atom(key: str) -> str:
    plain = NAME.match(key) and key not in RESERVED and key.lower() not in ("true", "false", "first_match")
    return key if plain else f'"{key}"'


_SPIN_WORDS: Final = frozenset({*SPIN.prefix, *SPIN.infix, *SPIN.true, *SPIN.false, "ltl"})


def _spin_atom(key: str) -> str:
    plain = re.match(r"[a-z_][A-Za-z0-9_]*\Z", key) and key not in _SPIN_WORDS
    return key if plain else f"{{{key}}}" if not re.search(r"[{}\n]", key) else f'"{key}"'


_NUSMV_WORDS: Final = frozenset({*NUSMV.prefix, *NUSMV.infix, *NUSMV.true, *NUSMV.false, "LTLSPEC", "NAME"})


def _nusmv_atom(key: str) -> str:
    plain = re.match(r"[A-Za-z_][A-Za-z0-9_]*\Z", key) and key not in _NUSMV_WORDS
    return key if plain else f'"{key}"'


def _spot_steps(f: Formula) -> str:
    return f"{f.op[0]}[{f.key}]"


def _nusmv_steps(f: Formula) -> str:
    first, last = step_bound(f)
    return "X " * first if f.op == "X[]" else f"{f.op[0]} [{first},{last}] "


_PREFIX: Final[dict[Op, str]] = {"not": "!", "X": "X ", "F": "F ", "G": "G "}
_PAST: Final[dict[Op, str]] = {"Y": "Y ", "Z": "Z ", "O": "O ", "H": "H "}
_INFIX: Final[dict[Op, str]] = {"implies": "->", "iff": "<->", "U": "U"}


def _with_bounds(f: Formula) -> str:
    return f"{written(f)} "


SPELLINGS: Final[dict[str, _Spelling]] = {
    "llfsm": _Spelling(
        "a property file",
        {**_PREFIX, **_PAST},
        {**_INFIX, "and": "&&", "or": "||", "xor": "xor", "W": "W", "R": "R", "M": "M", "S": "S", "T": "T"},
        "true", "false", _ours, {}, _with_bounds, bounds=True,
    ),
    "spot": _Spelling(
        "Spot",
        _PREFIX,
        {**_INFIX, "and": "&", "or": "|", "xor": "xor", "W": "W", "R": "R", "M": "M"},
        "1", "0", _spot_atom, {}, _spot_steps, expressions=True,
    ),
    "spin": _Spelling(
        "SPIN",
        {"not": "!", "X": "X ", "F": "<> ", "G": "[] "},
        {**_INFIX, "and": "&&", "or": "||", "R": "V"},
        "true", "false", _spin_atom, {"W": _weak_until, "M": _strong_release, "xor": _different},
    ),
    "nusmv": _Spelling(
        "NuSMV",
        {**_PREFIX, **_PAST},
        {**_INFIX, "and": "&", "or": "|", "xor": "xor", "R": "V", "S": "S", "T": "T"},
        "TRUE", "FALSE", _nusmv_atom, {"W": _weak_until, "M": _strong_release}, _nusmv_steps,
    ),
}  # fmt: skip
"""How each of the syntaxes writes formulas."""
