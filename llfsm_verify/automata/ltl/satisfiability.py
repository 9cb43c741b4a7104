"""Is there a word that satisfies a formula, and does every word? A plain one's automaton is made only as far as the
search for a word goes."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import Alphabet, L, alphabet_of, cubes
from llfsm_verify.automata.ltl.expansion import Expansion
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.ltl.translation import automaton_of
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.products import Letter, Word, accepted_word
from llfsm_verify.logic.formula import (
    TIMED,
    Formula,
    apply,
    atom,
    atoms,
    conjunction,
    is_plain,
    negation,
    operators,
    size,
)
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import exclusions
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import Simplifier

FEW_NODES = 40
"""Formulas of so many subformulas are searched as they are: to simplify them would take longer."""
MAX_STATES = 1_000
MAX_TRANSITIONS = 20_000
"""Sizes of what the search makes at which the whole automaton is made from parts instead, and reduced."""


def satisfying_word(formula: Formula, *, negate: bool = False, implies: Implication | None = None) -> Word | None:
    """A word that satisfies `formula` (`negate`: that does not); None: no word does.

    ValueError: it is not of plain temporal logic. AutomatonTooLarge as for `translate`. Source: Couvreur, On-the-fly
    verification of linear temporal logic, FM 1999. `implies`: see `Simplifier`.
    """
    if not is_plain(formula):
        raise ValueError("only plain temporal logic: no past, bounds or regular expressions")
    simplifier = Simplifier(implies)
    simple = nnf(formula, negate)
    if size(simple) > FEW_NODES:
        simple = simplifier.simplify(simple)
    keys = atoms(simple)
    alphabet = alphabet_of(len(keys))
    try:
        expansion = Expansion(alphabet, {key: i for i, key in enumerate(keys)}, simplifier.implies, MAX_TRANSITIONS)
        sets, row = expansion.lazily(simple, MAX_STATES, MAX_TRANSITIONS)
        found = find_accepting_lasso([0], row, sets)
        if found is None:
            return None
        order = sorted(range(len(keys)), key=lambda i: atoms(formula).index(keys[i]))
        stem, loop = (
            tuple(_letter(alphabet, label, keys, order) for label, _ in steps) for steps in (found.stem, found.loop)
        )
    except AutomatonTooLarge:
        return accepted_word(translate(formula, negate=negate))
    return stem, loop


def _letter(alphabet: Alphabet[L], label: L, keys: Sequence[str], order: Sequence[int]) -> Letter:
    """One of the letters of `label`, saying no more than it must; atoms in the order of the formula."""
    positive, negative = cubes(alphabet, label)[0]
    return tuple((keys[i], bool(positive >> i & 1)) for i in order if (positive | negative) >> i & 1)


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
