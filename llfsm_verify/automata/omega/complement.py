"""The complement of an automaton, where it is cheap: deterministic ones, and those all of whose runs accept."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.finite.expressions import Subset, explore_subsets
from llfsm_verify.automata.omega.products import is_deterministic
from llfsm_verify.automata.omega.reduction import smaller

MAX_STATES = 20_000


class NotDeterministic(Exception):
    """The complement would need a determinisation for infinite words, which is not offered."""


def has_complement(automaton: Automaton) -> bool:
    """Whether `complement` can be told: the automaton is deterministic, or has no acceptance sets."""
    return automaton.acceptance_sets == 0 or is_deterministic(automaton)


def complement(automaton: Automaton) -> Automaton:
    """The automaton of the words that `automaton` does not accept.

    A run of a deterministic automaton that is not accepted takes transitions of some set only finitely often: a copy
    without that set guesses from where on. When all runs accept, subsets of states are deterministic too.
    NotDeterministic: neither is so. AutomatonTooLarge: more than `MAX_STATES` subsets.
    """
    guards = Guards(automaton.atoms)
    if automaton.is_empty:
        return Automaton(automaton.atoms, ((Edge(0, 0, 0, 0),),), 0)
    if automaton.acceptance_sets == 0:
        rows = _subset_rows(automaton, guards)
    elif is_deterministic(automaton):
        rows = [_row(automaton.edges[q], guards) for q in range(len(automaton.edges))]
    else:
        raise NotDeterministic
    return smaller(_avoiding(rows, automaton, guards))


_Row = list[tuple[Guard, int, int]]
"""Transitions: letters (disjoint), target, acceptance."""


def _row(edges: tuple[Edge, ...], guards: Guards) -> _Row:
    joint: dict[tuple[int, int], Guard] = {}
    for e in edges:
        cube = guards.cube(e.positive, e.negative)
        key = (e.target, e.acceptance)
        joint[key] = joint[key] | cube if key in joint else cube
    return [(guard, target, acceptance) for (target, acceptance), guard in joint.items()]


def _subset_rows(automaton: Automaton, guards: Guards) -> list[_Row]:
    rows = [_row(edges, guards) for edges in automaton.edges]

    def following(states: Subset) -> Iterator[tuple[Guard, Subset]]:
        leaving = [edge for q in sorted(states) for edge in rows[q]]
        for part, inside in guards.partition(guard for guard, _, _ in leaving).items():
            if targets := frozenset(t for guard, t, _ in leaving if guard in inside):
                yield part, targets

    _, edges = explore_subsets(frozenset((0,)), following, MAX_STATES)
    return [[(guard, target, 0) for guard, target in row] for row in edges]


def _avoiding(rows: list[_Row], automaton: Automaton, guards: Guards) -> Automaton:
    """The words whose run ends for want of a transition, or misses some acceptance set from some place on."""
    n, sets = len(rows), automaton.acceptance_sets
    lost = n * (sets + 1)
    table: list[list[Edge]] = [[] for _ in range(lost + 1)]

    def add(source: int, guard: Guard, target: int, acceptance: int) -> None:
        table[source] += (Edge(p, m, target, acceptance) for p, m in guards.cubes(guard))

    for q, row in enumerate(rows):
        known = guards.union(guard for guard, _, _ in row)
        for copy in range(sets + 1):
            add(copy * n + q, ~known, lost, 0)
        for guard, target, acceptance in row:
            add(q, guard, target, 0)
            for k in range(sets):
                if not acceptance >> k & 1:
                    add(q, guard, (k + 1) * n + target, 0)
                    add((k + 1) * n + q, guard, (k + 1) * n + target, 1)
    table[lost].append(Edge(0, 0, lost, 1))
    return Automaton(automaton.atoms, tuple(map(tuple, table)), 1)
