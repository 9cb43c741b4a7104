"""A formula over literals: an atom and its negation become two propositions, in which the formula is monotone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.formula import (
    BINDING,
    STEPS,
    Formula,
    apply,
    atom,
    atoms,
    conjunction,
    disjunction,
    operators,
)
from llfsm_verify.logic.rewriting.normal_form import Negations, rewritten

NEGATIVE: Final = HIDDEN + "!"
"""The key of the proposition of a negated atom starts so."""

Places = dict[tuple[Formula, bool], Formula]
"""The formula over literals of each subformula in a place (True: under an odd number of negations)."""


def over_literals(f: Formula) -> Places | None:
    """`f` and its subformulas over literals; None: it has regular expressions or step bounds, which have none."""
    return None if operators(f) & (BINDING | STEPS) else rewritten(f, False, _OVER_LITERALS)


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


def _literal(f: Formula, negative: bool) -> Formula:
    return atom(NEGATIVE + f.key) if negative else f


_OVER_LITERALS = Negations(_literal, conjunction, disjunction, lambda op, args, bound: apply(op, *args, bound=bound))
