"""Is there an accepting run? Decided on the fly by strongly connected components, answered with a stem and a loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from llfsm_verify.limits import tick

NodeT = TypeVar("NodeT", bound=Hashable)
DataT = TypeVar("DataT")

Successors = Callable[[NodeT], Iterable[tuple[DataT, int, NodeT]]]
"""The edges of a node: any data, the mask of the acceptance sets the edge is in, the target. The same at each call."""


@dataclass(frozen=True, slots=True)
class GraphLasso(Generic[DataT, NodeT]):
    """A run: from `start` over the edges of `stem`, then those of `loop` (at least one) again and again.

    Each step is an edge's data with the node it leads to; the last node of `loop` is the last of `stem`, or `start`.
    """

    start: NodeT
    stem: tuple[tuple[DataT, NodeT], ...]
    loop: tuple[tuple[DataT, NodeT], ...]


@dataclass(slots=True)
class _Root:
    """A component on the search path: its first place among the active nodes, the acceptance of the edge that entered
    it and of the edges inside."""

    place: int
    entered: int
    inside: int


def find_accepting_lasso(
    initial: Iterable[NodeT], successors: Successors[NodeT, DataT], acceptance_sets: int
) -> GraphLasso[DataT, NodeT] | None:
    """A run from one of `initial` that takes edges of each acceptance set infinitely often; None when no run does.

    With no sets any infinite run does. The stem is a shortest path to the component found, the loop goes to the nearest
    edge of a set that is missing until none is. Source:
    Couvreur, On-the-fly verification of linear temporal logic, FM 1999; Gabow, Path-based depth-first search,
    IPL 74 (2000).
    """
    starts = list(dict.fromkeys(initial))
    component = _accepting_component(starts, successors, (1 << acceptance_sets) - 1)
    if component is None:
        return None
    start, stem = _shortest(starts, successors, lambda _, target: target in component, component.__contains__)
    entry = stem[-1][1] if stem else start
    return GraphLasso(start, tuple(stem), tuple(_loop(entry, successors, component, (1 << acceptance_sets) - 1)))


def _accepting_component(starts: list[NodeT], successors: Successors[NodeT, DataT], full: int) -> set[NodeT] | None:
    """Nodes strongly connected by edges that together are in all sets (part of a component is enough)."""
    place: dict[NodeT, int] = {}  # among the active nodes; -1: the node's component is closed, and not accepting
    active: list[NodeT] = []
    roots: list[_Root] = []
    path: list[tuple[int, Iterator[tuple[DataT, int, NodeT]]]] = []

    def push(node: NodeT, entered: int) -> None:
        tick()
        place[node] = len(active)
        roots.append(_Root(len(active), entered, 0))
        path.append((len(active), iter(successors(node))))
        active.append(node)

    for start in starts:
        if start in place:
            continue
        push(start, 0)
        while path:
            here, edges = path[-1]
            for _, acceptance, target in edges:
                there = place.get(target)
                if there is None:
                    push(target, acceptance)
                    break
                if there >= 0:
                    while roots[-1].place > there:
                        root = roots.pop()
                        acceptance |= root.inside | root.entered
                    roots[-1].inside |= acceptance
                    if roots[-1].inside == full:
                        return set(active[roots[-1].place :])
            else:
                path.pop()
                if roots[-1].place == here:
                    roots.pop()
                    for node in active[here:]:
                        place[node] = -1
                    del active[here:]
    return None


def _shortest(
    starts: list[NodeT],
    successors: Successors[NodeT, DataT],
    wanted: Callable[[int, NodeT], bool],
    at_start: Callable[[NodeT], bool] = lambda _: False,
) -> tuple[NodeT, list[tuple[DataT, NodeT]]]:
    """A shortest path, breadth first, to the first edge `wanted` (by acceptance and target) or a start `at_start`."""
    for start in starts:
        if at_start(start):
            return start, []
    came: dict[NodeT, tuple[NodeT, DataT] | None] = dict.fromkeys(starts)
    queue = deque(starts)
    while queue:
        node = queue.popleft()
        tick()
        for data, acceptance, target in successors(node):
            if wanted(acceptance, target):
                path = [(data, target)]
                while (step := came[node]) is not None:
                    path.append((step[1], node))
                    node = step[0]
                path.reverse()
                return node, path
            if target not in came:
                came[target] = (node, data)
                queue.append(target)
    raise AssertionError("the component that was found cannot be reached again: successors differ between calls")


def _any_of(sets: int) -> Callable[[int, NodeT], bool]:
    return lambda mask, _: bool(mask & sets)


def _loop(
    entry: NodeT, successors: Successors[NodeT, DataT], component: set[NodeT], full: int
) -> list[tuple[DataT, NodeT]]:
    def inside(node: NodeT) -> Iterator[tuple[tuple[DataT, int], int, NodeT]]:
        return (((data, mask), mask, target) for data, mask, target in successors(node) if target in component)

    loop: list[tuple[tuple[DataT, int], NodeT]] = []
    node, missing = entry, full
    while missing or not loop or node != entry:
        _, path = _shortest([node], inside, _any_of(missing) if missing else lambda _, target: target == entry)
        loop += path
        node = path[-1][1]
        for (_, mask), _ in path:
            missing &= ~mask
    return [(data, target) for (data, _), target in loop]
