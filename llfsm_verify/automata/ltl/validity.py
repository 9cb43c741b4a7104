"""What is true or false by itself, whatever the arrangement: formulas over free letters, decided by automata."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.ltl.satisfiability import satisfying_word
from llfsm_verify.automata.ltl.translation import automaton_of
from llfsm_verify.automata.omega.witnesses import accepted_word
from llfsm_verify.logic.formula import TIMED, Formula, apply, atom, atoms, conjunction, is_plain, negation, operators
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import exclusions


def is_satisfiable(formula: Formula) -> bool | None:
    """Whether some word satisfies `formula`; None for bounds in time, about which words of letters say nothing.

    AutomatonTooLarge, as for `translate`.
    """
    if operators(formula) & TIMED:
        return None
    if is_plain(formula):
        return satisfying_word(formula) is not None
    return accepted_word(automaton_of(formula)) is not None


def is_valid(formula: Formula) -> bool | None:
    """Whether every word satisfies `formula`, also those in which a machine is in two states; None as above."""
    keys = atoms(formula)
    if is_plain(formula) and not all(
        evaluate(formula, (), (letter,)) for letter in (frozenset[str](), frozenset(keys))
    ):
        return False  # a look at two words spares most formulas an automaton
    satisfiable = is_satisfiable(negation(formula))
    return None if satisfiable is None else not satisfiable


def forbids(formula: Formula, key: str) -> bool:
    """Whether `formula` itself demands that an atom never holds; True also where that is not known."""
    return not is_satisfiable(conjunction((formula, apply("F", atom(key)))))


def contradict(formulas: Sequence[Formula]) -> bool:
    """Whether no word in which each machine is in one state at a time satisfies all formulas; False: not known."""
    together = conjunction(formulas)
    world = apply("G", exclusions(atoms(*formulas)))
    return is_satisfiable(conjunction((together, world))) is False
