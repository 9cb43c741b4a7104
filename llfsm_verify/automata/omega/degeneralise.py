"""One acceptance set, on states, in place of several on transitions: a counter of the sets already met."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, permutations

from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.pruning import inner_acceptance
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, kept, merged_row

MAX_ORDERS = 24
MAX_WORK = 20_000
"""Orders in which the sets are waited for that are tried, and how often a transition is looked at in all of them."""


def state_based(graph: Symbolic[L]) -> Symbolic[L]:
    """An automaton with at most one set in which all transitions of a state are in it, or none.

    The order of waiting that gives the fewest states is taken. Source: Gastin and Oddoux, Fast LTL to Büchi automata
    translation, CAV 2001; the counter starts anew in each component, and what all transitions into or out of a state
    have in common is counted early: Babiak, Badie, Duret-Lutz, Křetínský and Strejček, SPIN 2013.
    """
    component = graph.components()
    inner = inner_acceptance(graph, component)
    accepted = [inner.get(c) == graph.full for c in range(max(component, default=-1) + 1)]
    if not graph.rows:
        return graph
    best: Symbolic[L] | None = None
    tries = max(1, min(MAX_ORDERS, MAX_WORK // (1 + sum(map(len, graph.rows)))))
    for order in islice(permutations(range(graph.sets)), tries):
        found = _one_copy(graph, _counted(graph, component, accepted, order), component, graph.sets)
        if best is None or len(found.rows) < len(best.rows):
            best = found
    assert best is not None
    return best


Node = tuple[int, int]
"""A state and its level: how many sets of the order have been met; a state with all of them is accepting."""


def _counted(
    graph: Symbolic[L], component: Sequence[int], accepted: Sequence[bool], order: Sequence[int]
) -> dict[Node, list[tuple[L, Node]]]:
    sets = len(order)
    ahead = [graph.full] * len(graph.rows)  # sets met by whatever comes next
    for state, row in enumerate(graph.rows):
        inside = [a for _, a, target in row if component[target] == component[state]]
        for acceptance in inside:
            ahead[state] &= acceptance
        if not inside:
            ahead[state] = 0
    entry: dict[int, int] = {}

    def advanced(level: int, acceptance: int) -> int:
        while level < sets and acceptance >> order[level] & 1:
            level += 1
        return level

    def entered(state: int) -> Node:
        if not accepted[component[state]]:
            return state, -1
        return state, entry.setdefault(state, advanced(0, ahead[state]))

    found: dict[Node, list[tuple[L, Node]]] = {}
    queue = [entered(0)]
    for node in queue:
        if node in found:
            continue
        state, level = node
        steps: list[tuple[L, Node]] = []
        for label, acceptance, target in graph.rows[state]:
            if component[target] != component[state] or level < 0:
                steps.append((label, entered(target)))
            else:
                start = 0 if level == sets else level
                reached = advanced(start, acceptance | ahead[target])
                entry.setdefault(target, reached)
                steps.append((label, (target, reached)))
        found[node] = steps
        queue += (following for _, following in steps)
    return found


def _one_copy(
    graph: Symbolic[L], found: dict[Node, list[tuple[L, Node]]], component: Sequence[int], sets: int
) -> Symbolic[L]:
    """The nodes numbered, of each component's copies only one that cannot be left for another (all mean the same)."""
    numbers = {node: i for i, node in enumerate(found)}
    copies = components([[numbers[following] for _, following in steps] for steps in found.values()])
    lowest: dict[int, int] = {}
    for node, copy in zip(found, copies, strict=True):
        original = component[node[0]]
        lowest[original] = min(lowest.get(original, copy), copy)
    place: dict[int, int] = {}
    for node, copy in zip(found, copies, strict=True):
        if copy == lowest[component[node[0]]]:
            place.setdefault(node[0], numbers[node])

    def placed(node: Node) -> int:
        number = numbers[node]
        return number if copies[number] == lowest[component[node[0]]] else place[node[0]]

    rows: list[tuple[Arc[L], ...]] = [
        merged_row((label, int(level == sets), placed(following)) for label, following in steps)
        for (_, level), steps in found.items()
    ]
    first = placed(next(iter(found)))
    return kept(Symbolic(graph.alphabet, tuple(rows), 1), [True] * len(rows), first)
