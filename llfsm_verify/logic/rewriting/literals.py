"""A formula over literals: an atom and its negation become two propositions, in which the formula is monotone."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from llfsm_verify.logic.bounds import HIDDEN, rebuilt
from llfsm_verify.logic.formula import (
    BINDING,
    FALSE,
    STEPS,
    TRUE,
    Formula,
    Op,
    apply,
    atom,
    atoms,
    conjunction,
    disjunction,
    operators,
)
from llfsm_verify.logic.rewriting.normal_form import rewritten

NEGATIVE: Final = HIDDEN + "!"
"""The key of the proposition of a negated atom starts so."""

Places = dict[tuple[Formula, bool], Formula]
"""The formula over literals of each subformula in a place (True: under an odd number of negations)."""

_DUAL: dict[Op, Op] = {
    "F": "G", "G": "F", "U": "R", "R": "U", "W": "M", "M": "W", "X": "X",
    "Y": "Z", "Z": "Y", "O": "H", "H": "O", "S": "T", "T": "S", "F<=": "G<=", "G<=": "F<=",
    "U<=": "R<=", "R<=": "U<=",
}  # fmt: skip


def over_literals(f: Formula) -> Places | None:
    """`f` and its subformulas over literals; None: it has regular expressions or step bounds, which have none."""
    return None if operators(f) & (BINDING | STEPS) else rewritten(f, False, _literal)


def literal_letter(keys: Iterable[str], letter: frozenset[str]) -> frozenset[str]:
    """The literals over atoms `keys` that hold in a letter."""
    return frozenset(key if key in letter else NEGATIVE + key for key in keys)


def every_literal(f: Formula) -> frozenset[str]:
    """A letter in which all literals over the atoms of `f` hold."""
    keys = atoms(f)
    return frozenset((*keys, *(NEGATIVE + key for key in keys)))


def atom_of(literal: str) -> str:
    """The atom that a literal is about."""
    return literal.removeprefix(NEGATIVE)


def _literal(f: Formula, negative: bool, of: Callable[[Formula, bool], Formula]) -> Formula:
    match f.op:
        case "true" | "false":
            return TRUE if (f.op == "true") != negative else FALSE
        case "atom":
            return atom(NEGATIVE + f.key) if negative else f
        case "not":
            return of(f.args[0], not negative)
        case "implies":
            parts = of(f.args[0], not negative), of(f.args[1], negative)
            return conjunction(parts) if negative else disjunction(parts)
        case "xor" | "iff":
            a, b = f.args
            same = (f.op == "iff") != negative
            pairs = ((of(a, n), of(b, n == same)) for n in (False, True))
            return disjunction(conjunction(pair) for pair in pairs)
    args = tuple(of(a, negative) for a in f.args)
    if f.op in ("and", "or"):
        return conjunction(args) if (f.op == "and") != negative else disjunction(args)
    if not negative:
        return rebuilt(f, args)
    return apply(_DUAL[f.op], *args, bound=f.key)
