"""The subset construction: which states an automaton can be in after a finite word."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.labels import Cube, L, alphabet_of
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.pruning import tidy
from llfsm_verify.automata.omega.simulation import simulating
from llfsm_verify.automata.omega.symbolic import Symbolic, cubes_at, from_automaton, mentioned, narrowed
from llfsm_verify.limits import tick

Step = tuple[L, int]
"""The letters, the state reached."""


@dataclass(frozen=True, slots=True)
class Subsets(Generic[L]):
    """A deterministic automaton without acceptance; state 0 is initial, letters without a step empty the set.

    `members[s]`: the mask of the automaton's states that subset s has (never 0); a state is left out when another one
    in the subset simulates it. The labels of a row are disjoint.
    """

    members: tuple[int, ...]
    rows: tuple[tuple[Step[L], ...], ...]

    def components(self) -> list[int]:
        """The component of each subset; steps never lead to a higher number."""
        return components([[target for _, target in row] for row in self.rows])


def subsets(graph: Symbolic[L], max_subsets: int, max_steps: int) -> Subsets[L]:
    """The subsets that can be reached; AutomatonTooLarge beyond `max_subsets`, or `max_steps` steps in all."""
    if not graph.rows:
        return Subsets((), ())
    above = simulating(tidy(graph, transient=True))
    numbers = {1: 0}
    queue = [1]
    rows: list[tuple[Step[L], ...]] = []
    made = 0
    for members in queue:
        tick()
        row: list[Step[L]] = []
        regions = regions_of(graph, members, made, max_steps)
        for label, targets in _merged((label, maximal(targets, above)) for label, targets in regions):
            number = numbers.setdefault(targets, len(queue))
            if number == len(queue):
                queue.append(targets)
                if len(queue) > max_subsets:
                    raise AutomatonTooLarge("states", max_subsets)
            row.append((label, number))
        made += len(row)
        rows.append(tuple(row))
    return Subsets(tuple(queue), tuple(rows))


def monitor_rows(automaton: Automaton, max_subsets: int, max_cubes: int) -> list[list[tuple[int | None, list[Cube]]]]:
    """For each subset the steps to others with the letters that take them; None: those after which none is left.

    Every run of `automaton`, which has an initial state, counts. AutomatonTooLarge: more than `max_subsets`, or
    `max_cubes` in all.
    """
    places = mentioned(automaton)
    alphabet = alphabet_of(len(places))
    rows: list[list[tuple[int | None, list[Cube]]]] = []
    made = 0
    for row in subsets(from_automaton(narrowed(automaton, places), alphabet), max_subsets, max_cubes).rows:
        left = alphabet.true
        for label, _ in row:
            left = left & ~label
        steps = [*row, *([(left, None)] if left else [])]
        rows.append([])
        for label, target in steps:
            here = cubes_at(alphabet, label, places)
            made += len(here)
            if made > max_cubes:
                raise AutomatonTooLarge("transitions", max_cubes)
            rows[-1].append((target, here))
    return rows


def regions_of(graph: Symbolic[L], members: int, made: int, max_steps: int) -> list[tuple[L, int]]:
    """The letters by the set of states that they lead `members` to; those that lead to none are left out.

    AutomatonTooLarge: with the steps already `made` there are more than `max_steps`.
    """
    by_target: dict[int, L] = {}
    for state in states_of(members):
        for label, _, target in graph.rows[state]:
            known = by_target.get(target)
            by_target[target] = label if known is None else known | label
    parts: list[tuple[L, int]] = [(graph.alphabet.true, 0)]
    for target, label in by_target.items():
        parts = split(parts, label, 1 << target)
        if made + len(parts) > max_steps + 1:  # one of them may lead nowhere
            raise AutomatonTooLarge("transitions", max_steps)
    return _merged((label, targets) for label, targets in parts if targets)


def _merged(parts: Iterable[tuple[L, int]]) -> list[tuple[L, int]]:
    merged: dict[int, L] = {}
    for label, targets in parts:
        known = merged.get(targets)
        merged[targets] = label if known is None else known | label
    return [(label, targets) for targets, label in merged.items()]


def maximal(members: int, above: Sequence[int]) -> int:
    """`members` without those that another one simulates (of several that simulate each other, the lowest stays).

    `above[q]`: the mask of the states that simulate q.
    """
    kept = members
    for state in states_of(members):
        better = above[state] & kept & ~(1 << state)
        if better and any(p < state or not above[p] >> state & 1 for p in states_of(better)):
            kept &= ~(1 << state)
    return kept


def split(regions: Sequence[tuple[L, int]], label: L, bit: int) -> list[tuple[L, int]]:
    """Each region cut in two by `label`; the part inside gets `bit`."""
    found: list[tuple[L, int]] = []
    for region, mask in regions:
        inside = region & label
        if inside:
            found.append((inside, mask | bit))
        outside = region & ~label
        if outside:
            found.append((outside, mask))
    return found


def states_of(mask: int) -> list[int]:
    """The numbers of the bits of `mask`, ascending."""
    found: list[int] = []
    while mask:
        low = mask & -mask
        found.append(low.bit_length() - 1)
        mask ^= low
    return found
