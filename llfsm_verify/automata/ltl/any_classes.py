"""The class of any formula, and its automaton with acceptance on states: also with the past and regular expressions."""

from __future__ import annotations

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.automata.labels import MAX_TABLE, Alphabet, L, TruthTables
from llfsm_verify.automata.ltl import classes
from llfsm_verify.automata.ltl.classes import PropertyClass
from llfsm_verify.automata.ltl.translate import translate, without_sets
from llfsm_verify.automata.ltl.translation import automaton_of
from llfsm_verify.automata.omega.degeneralise import state_based
from llfsm_verify.automata.omega.reduction import reduce_by_state
from llfsm_verify.automata.omega.symbolic import from_automaton, to_automaton
from llfsm_verify.logic.bounds import without_steps
from llfsm_verify.logic.formula import Formula, is_plain
from llfsm_verify.logic.rewriting.simplify import Simplifier


def classify_any(formula: Formula, *, simplifier: Simplifier | None = None) -> PropertyClass | None:
    """The smallest class of `formula`, whatever operators it has; None: its automata are too large to tell.

    Plain formulas as `classify`, others by the automata of the formula and of its negation. Untranslatable: bounds in
    time, for which words of letters lack the time.
    """
    plain = without_steps(formula)
    if is_plain(plain):
        return classes.classify(plain, simplifier=simplifier)
    try:
        sides = [automaton_of(plain, negate=negate) for negate in (False, True)]
    except AutomatonTooLarge:
        return None

    def over(alphabet: Alphabet[L]) -> PropertyClass | None:
        graph, opposite = (from_automaton(side, alphabet) for side in sides)
        return classes.of_automata(graph, opposite).smallest

    keys = sides[0].atoms
    return over(TruthTables(len(keys))) if len(keys) <= MAX_TABLE else over(Diagrams(len(keys)))


def buchi_of(formula: Formula) -> Automaton:
    """The Büchi automaton of `formula`: at most one acceptance set, with all transitions of a state or none.

    Untranslatable: bounds in time. AutomatonTooLarge as for `translate`.
    """
    plain = without_steps(formula)
    if is_plain(plain):
        return translate(plain, generalised=False)
    automaton = automaton_of(plain)

    def over(alphabet: Alphabet[L]) -> Automaton:
        graph = reduce_by_state(state_based(from_automaton(automaton, alphabet)))
        return to_automaton(without_sets(graph), automaton.atoms, range(len(automaton.atoms)))

    size = len(automaton.atoms)
    return over(TruthTables(size)) if size <= MAX_TABLE else over(Diagrams(size))
