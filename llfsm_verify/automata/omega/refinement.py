"""Which states of a deterministic automaton step alike: the coarsest partition, refined where something changed."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import Protocol, Self, TypeVar

from llfsm_verify.limits import tick


class LetterSet(Protocol):
    """A set of letters."""

    def __or__(self, other: Self, /) -> Self: ...

    def __hash__(self) -> int: ...


L = TypeVar("L", bound=LetterSet)
Row = frozenset[tuple[int, L]]


def equivalent(rows: Sequence[Sequence[tuple[L, int]]], classes: Sequence[Hashable]) -> list[int]:
    """The coarsest refinement of `classes` in which states of a class step alike: classes numbered in order.

    `rows[q]` are the steps from q: a set of letters and a state; the sets of a row are disjoint. Steps to one class are
    one. A state is looked at again only when one that it leads to has changed its class, and of the parts of a class
    the largest keeps its number, so that long chains take no quadratic time. Source: Hopcroft, An n log n algorithm
    for minimizing states in a finite automaton, 1971.
    """
    numbers: dict[Hashable, int] = {}
    block = [numbers.setdefault(c, len(numbers)) for c in classes]
    members: list[set[int]] = [set() for _ in numbers]
    before: list[list[int]] = [[] for _ in rows]
    for state, row in enumerate(rows):
        members[block[state]].add(state)
        for _, target in row:
            before[target].append(state)
    due: Iterable[int] = range(len(rows))
    while due:
        looked_at: dict[int, dict[int, Row[L]]] = {}
        for state in due:
            tick()
            looked_at.setdefault(block[state], {})[state] = _steps(rows[state], block)
        parts: list[tuple[int, list[int]]] = []
        for name, found in looked_at.items():
            parts += [(name, part) for part in _smaller_parts(members[name], found, rows, block)]
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


def _smaller_parts(
    members: set[int], found: dict[int, Row[L]], rows: Sequence[Sequence[tuple[L, int]]], block: Sequence[int]
) -> list[list[int]]:
    """A class divided by the steps of its states, without the largest part.

    `found` are the steps of those looked at; the others have theirs in common, since nothing that they lead to changed.
    """
    groups: dict[Row[L], list[int]] = {}
    for state, steps in found.items():
        groups.setdefault(steps, []).append(state)
    others = len(members) - len(found)
    common: Row[L] | None = None
    if others:
        common = _steps(rows[next(state for state in members if state not in found)], block)
        groups.setdefault(common, [])
    largest = max(groups, key=lambda steps: len(groups[steps]) + (others if steps == common else 0))
    parts = []
    for steps, part in groups.items():
        if steps != largest:
            parts.append(part + [q for q in members if q not in found] if steps == common else part)
    return parts


def _steps(row: Sequence[tuple[L, int]], block: Sequence[int]) -> Row[L]:
    return frozenset(by_class(row, block).items())


def by_class(row: Sequence[tuple[L, int]], block: Sequence[int]) -> dict[int, L]:
    """The letters that lead to each class."""
    labels: dict[int, L] = {}
    for label, target in row:
        known = labels.get(block[target])
        labels[block[target]] = label if known is None else known | label
    return labels
