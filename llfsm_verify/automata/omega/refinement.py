"""Which states of a deterministic automaton step alike: the coarsest partition, refined where something changed."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Protocol, Self, TypeVar

from llfsm_verify.limits import tick


class LetterSet(Protocol):
    """A set of letters."""

    def __or__(self, other: Self, /) -> Self: ...

    def __hash__(self) -> int: ...


L = TypeVar("L", bound=LetterSet)
Step = Callable[[int, Sequence[int]], Hashable]
"""What a state does, told by the classes of all states."""


def equivalent(rows: Sequence[Sequence[tuple[L, int]]], classes: Sequence[Hashable]) -> list[int]:
    """The coarsest refinement of `classes` in which states of a class step alike: classes numbered in order.

    `rows[q]` are the steps from q: a set of letters and a state; the sets of a row are disjoint. Steps to one class are
    one.
    """
    targets = [[target for _, target in row] for row in rows]
    return coarsest(targets, lambda state, block: frozenset(by_class(rows[state], block).items()), classes)


def coarsest(targets: Sequence[Iterable[int]], step: Step, classes: Sequence[Hashable]) -> list[int]:
    """The coarsest refinement of `classes` in which `step` is the same for the states of a class: numbered in order.

    A state is looked at again only when one of `targets[q]`, where it leads to, has changed its class, and of the parts
    of a class the largest keeps its number, so that long chains take no quadratic time. Source: Hopcroft, An n log n
    algorithm for minimizing states in a finite automaton, 1971.
    """
    numbers: dict[Hashable, int] = {}
    block = [numbers.setdefault(c, len(numbers)) for c in classes]
    members: list[set[int]] = [set() for _ in numbers]
    before: list[list[int]] = [[] for _ in targets]
    for state, reached in enumerate(targets):
        members[block[state]].add(state)
        for target in reached:
            before[target].append(state)
    due: Iterable[int] = range(len(targets))
    while due:
        looked_at: dict[int, dict[int, Hashable]] = {}
        for state in due:
            tick()
            looked_at.setdefault(block[state], {})[state] = step(state, block)
        parts: list[tuple[int, list[int]]] = []
        for name, found in looked_at.items():
            parts += [(name, part) for part in _smaller_parts(members[name], found, step, block)]
        changed: list[int] = []
        for name, part in parts:
            members[name].difference_update(part)
            for state in part:
                block[state] = len(members)
            members.append(set(part))
            changed += part
        due = sorted({source for state in changed for source in before[state]})
    order: dict[int, int] = {}
    return [order.setdefault(b, len(order)) for b in block]


def _smaller_parts(members: set[int], found: dict[int, Hashable], step: Step, block: Sequence[int]) -> list[list[int]]:
    """A class divided by the steps of its states, without the largest part.

    `found` are the steps of those looked at; the others have theirs in common, since nothing that they lead to changed.
    """
    groups: dict[Hashable, list[int]] = {}
    for state, steps in found.items():
        groups.setdefault(steps, []).append(state)
    others = len(members) - len(found)
    common: Hashable = None
    if others:
        common = step(next(state for state in members if state not in found), block)
        groups.setdefault(common, [])
    largest = max(groups, key=lambda steps: len(groups[steps]) + (others if steps == common else 0))
    parts = []
    for steps, part in groups.items():
        if steps != largest:
            parts.append(part + [q for q in members if q not in found] if steps == common else part)
    return parts


def by_class(row: Sequence[tuple[L, int]], block: Sequence[int]) -> dict[int, L]:
    """The letters that lead to each class."""
    labels: dict[int, L] = {}
    for label, target in row:
        known = labels.get(block[target])
        labels[block[target]] = label if known is None else known | label
    return labels
