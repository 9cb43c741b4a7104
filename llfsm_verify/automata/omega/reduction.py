"""Smaller automata of the same language: pruning and simulation in turns, until nothing gets smaller."""

from __future__ import annotations

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.labels import L, alphabet_of
from llfsm_verify.automata.omega.pruning import tidy, useful
from llfsm_verify.automata.omega.simulation import bisimulation, direct_simulation, reverse_simulation
from llfsm_verify.automata.omega.symbolic import Symbolic, from_automaton, mentioned, merged_row, narrowed, to_automaton


def reduce_automaton(graph: Symbolic[L]) -> Symbolic[L]:
    """Without states of empty language, similar states merged, as few sets and transitions as is easy to see.

    Whether transitions between components are in all acceptance sets or in none does not change the language, but it
    changes which states are similar: both are tried.
    """
    start = bisimulation(tidy(useful(graph), transient=False))
    best = start
    for transient in (False, True):
        found = start
        while len(found.rows) > 1:
            smaller = tidy(direct_simulation(tidy(found, transient=transient)), transient=transient)
            smaller = useful(reverse_simulation(smaller))
            if _size(smaller) >= _size(found):
                break
            found = smaller
        if _size(found) < _size(best):
            best = found
    return tidy(best, transient=False)


def reduce_by_state(graph: Symbolic[L]) -> Symbolic[L]:
    """The same for an automaton whose acceptance is on states (all transitions of one agree), which stays so."""
    found = bisimulation(useful(graph))
    while len(found.rows) > 1:
        smaller = useful(reverse_simulation(direct_simulation(found), by_state=True))
        if _size(smaller) >= _size(found):
            break
        found = smaller
    return found


def closure(graph: Symbolic[L]) -> Symbolic[L]:
    """The words all prefixes of which are prefixes of accepted words; every run counts, so there are no sets.

    Source: Alpern and Schneider, Recognizing safety and liveness, Distributed Computing 2 (1987).
    """
    rows = (tuple((label, 0, target) for label, _, target in row) for row in useful(graph).rows)
    return reduce_automaton(Symbolic(graph.alphabet, tuple(map(merged_row, rows)), 0))


def _size(graph: Symbolic[L]) -> tuple[int, int]:
    return len(graph.rows), sum(map(len, graph.rows))


def smaller(automaton: Automaton) -> Automaton:
    """The same language with fewer states, transitions and acceptance sets."""
    places = mentioned(automaton)
    graph = reduce_automaton(from_automaton(narrowed(automaton, places), alphabet_of(len(places))))
    return to_automaton(graph, automaton.atoms, places)


def closure_of(automaton: Automaton) -> Automaton:
    """An automaton without acceptance sets, with an accepted word from each state; see `reduction.closure`."""
    keys = automaton.atoms
    return to_automaton(closure(from_automaton(automaton, alphabet_of(len(keys)))), keys, range(len(keys)))
