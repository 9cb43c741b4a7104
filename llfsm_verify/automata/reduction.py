"""Smaller automata of the same language: useless states, useless acceptance sets, equal states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.components import components

MAX_COMPARED = 1_000
"""More transitions of one state than this are not compared with each other: it would take too long."""


def reduced(automaton: Automaton) -> Automaton:
    """Without states of empty language, equal states merged, and as few acceptance sets as is easy to see."""
    return _merged(_fewer_sets(_useful(automaton)))


def _useful(automaton: Automaton) -> Automaton:
    """Only states from which some word is accepted; the initial state comes first, without states when none is left."""
    targets = [[edge.target for edge in row] for row in automaton.edges]
    component = components(targets)
    inner: dict[int, int] = {}
    for state, row in enumerate(automaton.edges):
        for edge in row:
            if component[edge.target] == component[state]:
                inner[component[state]] = inner.get(component[state], 0) | edge.acceptance
    by_component: dict[int, list[int]] = {}
    for state, number in enumerate(component):
        by_component.setdefault(number, []).append(state)
    useful = [False] * len(targets)
    # Sinks have the lowest numbers, so that the targets outside a component are known before it.
    for number in sorted(by_component):
        members = by_component[number]
        if inner.get(number) == automaton.full or any(useful[t] for state in members for t in targets[state]):
            for state in members:
                useful[state] = True
    return _kept(automaton, useful)


def _kept(automaton: Automaton, keep: Sequence[bool]) -> Automaton:
    """The states to keep that are reachable through such states, renumbered breadth first."""
    if not automaton.edges or not keep[0]:
        return replace(automaton, edges=())
    numbers = {0: 0}
    order = [0]
    for state in order:
        for edge in automaton.edges[state]:
            if keep[edge.target] and edge.target not in numbers:
                numbers[edge.target] = len(order)
                order.append(edge.target)
    rows = (
        tuple(replace(edge, target=numbers[edge.target]) for edge in automaton.edges[state] if keep[edge.target])
        for state in order
    )
    return replace(automaton, edges=tuple(rows))


def _fewer_sets(automaton: Automaton) -> Automaton:
    """Drop acceptance sets that another one implies; a transition between components counts in every set.

    It is taken once at most, so its acceptance is free, and being in all sets makes more states equal.
    """
    component = components([[edge.target for edge in row] for row in automaton.edges])
    inner = [e for q, row in enumerate(automaton.edges) for e in row if component[e.target] == component[q]]
    columns = [
        sum(1 << i for i, edge in enumerate(inner) if edge.acceptance >> k & 1)
        for k in range(automaton.acceptance_sets)
    ]
    everything = (1 << len(inner)) - 1
    kept: list[int] = []
    for k, column in enumerate(columns):
        implied = any(other & ~column == 0 and (other != column or j < k) for j, other in enumerate(columns) if j != k)
        if column != everything and not implied:
            kept.append(k)
    full = (1 << len(kept)) - 1

    def moved(state: int, edge: Edge) -> Edge:
        if component[edge.target] != component[state]:
            return replace(edge, acceptance=full)
        return replace(edge, acceptance=sum(1 << i for i, k in enumerate(kept) if edge.acceptance >> k & 1))

    edges = tuple(tuple(moved(q, edge) for edge in row) for q, row in enumerate(automaton.edges))
    return Automaton(automaton.atoms, edges, len(kept))


def _merged(automaton: Automaton) -> Automaton:
    """States with equal futures become one (the coarsest bisimulation, by refinement from one class)."""
    n = len(automaton.edges)
    classes = [0] * n
    count = min(n, 1)
    while True:
        names: dict[frozenset[Edge], int] = {}
        refined = [
            names.setdefault(frozenset(replace(e, target=classes[e.target]) for e in row), len(names))
            for row in automaton.edges
        ]
        classes = refined
        if len(names) == count:
            break
        count = len(names)
    rows: list[tuple[Edge, ...]] = [()] * count
    for state in reversed(range(n)):
        rows[classes[state]] = tuple(replace(e, target=classes[e.target]) for e in automaton.edges[state])
    return replace(automaton, edges=tuple(map(_without_covered, rows)))


def _without_covered(row: tuple[Edge, ...]) -> tuple[Edge, ...]:
    """Transitions to one state of which none allows all that another one does."""
    if len(row) > MAX_COMPARED:
        return tuple(dict.fromkeys(row))
    kept: list[Edge] = []
    for edge in dict.fromkeys(row):
        if any(_covers(other, edge) for other in kept):
            continue
        kept = [other for other in kept if not _covers(edge, other)]
        kept.append(edge)
    return tuple(kept)


def _covers(edge: Edge, other: Edge) -> bool:
    return (
        edge.target == other.target
        and edge.positive & ~other.positive == 0
        and edge.negative & ~other.negative == 0
        and other.acceptance & ~edge.acceptance == 0
    )
