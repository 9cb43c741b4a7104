"""The closure of any automaton: the words that no finite prefix shows to be outside its language."""

from __future__ import annotations

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.automata.labels import MAX_TABLE, Alphabet, L, TruthTables
from llfsm_verify.automata.omega.reduction import closure
from llfsm_verify.automata.omega.symbolic import from_automaton, to_automaton


def closure_of(automaton: Automaton) -> Automaton:
    """An automaton without acceptance sets, with an accepted word from each state; see `reduction.closure`."""
    keys = automaton.atoms

    def over(alphabet: Alphabet[L]) -> Automaton:
        return to_automaton(closure(from_automaton(automaton, alphabet)), keys, range(len(keys)))

    return over(TruthTables(len(keys))) if len(keys) <= MAX_TABLE else over(Diagrams(len(keys)))
