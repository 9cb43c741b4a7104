"""Useless states and useless acceptance, found by strongly connected components."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, kept, merged_row


def inner_acceptance(graph: Symbolic[L], component: Sequence[int]) -> dict[int, int]:
    """The acceptance sets met inside each component that has a transition inside."""
    inner: dict[int, int] = {}
    for state, row in enumerate(graph.rows):
        here = component[state]
        for _, acceptance, target in row:
            if component[target] == here:
                inner[here] = inner.get(here, 0) | acceptance
    return inner


def useful(graph: Symbolic[L]) -> Symbolic[L]:
    """Only states from which some word is accepted; without states when no word is accepted."""
    component = graph.components()
    inner = inner_acceptance(graph, component)
    full = graph.full
    alive = [False] * (max(component, default=-1) + 1)
    states = sorted(range(len(component)), key=component.__getitem__)
    for state in states:  # sinks have the lowest numbers: what is outside a component is known before it
        here = component[state]
        if inner.get(here) == full or any(alive[component[target]] for _, _, target in graph.rows[state]):
            alive[here] = True
    return kept(graph, [alive[c] for c in component])


def tidy(graph: Symbolic[L], *, transient: bool) -> Symbolic[L]:
    """As few acceptance sets as is easy to see, and none where no run can be accepted.

    In each component of its own, a set that contains another one is dropped, and so is one with all transitions; the
    components then share sets by number. A transition between components is taken once at most: it is in all sets
    (`transient`) or in none. Source: Babiak, Badie, Duret-Lutz, Křetínský and Strejček, Compositional approach to
    suspension and other improvements to LTL translation, SPIN 2013.
    """
    component = graph.components()
    inner = inner_acceptance(graph, component)
    seen: dict[int, set[int]] = {number: set() for number, met in inner.items() if met == graph.full}
    for state, row in enumerate(graph.rows):
        here = component[state]
        if here in seen:
            seen[here].update(acceptance for _, acceptance, target in row if component[target] == here)
    chosen = {number: _needed_sets(graph.sets, masks) for number, masks in seen.items()}
    sets = max(map(len, chosen.values()), default=0)
    if any(number not in chosen for number in inner):
        sets = max(sets, 1)  # a rejecting cycle must stay one
    full = (1 << sets) - 1
    outside = full if transient else 0
    known: dict[tuple[int, int], int] = {}

    def moved(here: int, acceptance: int) -> int:
        needed = chosen.get(here)
        if needed is None:
            return 0
        mask = full & ~((1 << len(needed)) - 1)
        for i, k in enumerate(needed):
            if acceptance >> k & 1:
                mask |= 1 << i
        return mask

    def row_of(here: int, arcs: tuple[Arc[L], ...]) -> Iterator[Arc[L]]:
        for label, acceptance, target in arcs:
            if component[target] != here:
                yield label, outside, target
                continue
            mask = known.get((here, acceptance))
            if mask is None:
                mask = known[here, acceptance] = moved(here, acceptance)
            yield label, mask, target

    rows = tuple(merged_row(row_of(component[state], row)) for state, row in enumerate(graph.rows))
    return Symbolic(graph.alphabet, rows, sets)


def _needed_sets(sets: int, masks: set[int]) -> list[int]:
    """The acceptance sets that matter where the transitions are in those of `masks`."""
    kept_sets: list[int] = []
    for k in range(sets):
        outside = [mask for mask in masks if not mask >> k & 1]
        if not outside:
            continue
        if any(all(not mask >> j & 1 for mask in outside) for j in kept_sets):
            continue  # set j is inside set k
        kept_sets = [j for j in kept_sets if not all(not m >> k & 1 for m in masks if not m >> j & 1)]
        kept_sets.append(k)
    return kept_sets
