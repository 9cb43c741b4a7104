"""Searches of a graph with automata in plain Python, by another way than the kernels: the reference for their tests.

Product nodes are pairs of a node and a tuple of states, distances are found with a heap, lassos by the emptiness check
of `automata.omega.emptiness`, and the shortest lasso by trying every product node as the beginning of its loop.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from heapq import heappop, heappush
from itertools import product
from typing import TypeVar

from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.safety import BadPrefix
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product_search import Projection, Reader

States = tuple[int, ...]
Node = tuple[int, States]
NodeT = TypeVar("NodeT", bound=Hashable)
Weighted = Callable[[NodeT], Iterator[tuple[int, NodeT]]]
"""The letters (0 or 1) and the target of each edge."""


def distances(starts: Sequence[NodeT], edges: Weighted[NodeT]) -> dict[NodeT, int]:
    """The fewest letters to each node that can be reached (Dijkstra)."""
    found: dict[NodeT, int] = {}
    heap = [(0, i, node) for i, node in enumerate(starts)]
    fresh = len(heap)
    while heap:
        far, _, node = heappop(heap)
        if node in found:
            continue
        found[node] = far
        for letters, target in edges(node):
            if target not in found:
                fresh += 1
                heappush(heap, (far + letters, fresh, target))
    return found


def bad_prefix_length(graph: Graph, first: Sequence[int], monitor: BadPrefix, project: Projection) -> int | None:
    """Letters of a shortest bad prefix after the first letter; None: there is none."""
    begin = monitor.initial()
    if begin is None:
        return 0 if graph.roots else None

    def edges(node: tuple[int, int | None]) -> Iterator[tuple[int, tuple[int, int | None]]]:
        at, state = node
        if state is not None:
            for target, letter in graph.edges(at):
                yield (0, (target, state)) if letter is None else (1, (target, monitor.step(state, project(letter))))

    starts = [(root, monitor.step(begin, project(first[root]))) for root in range(graph.roots)]
    bad = [far for (_, state), far in distances(starts, edges).items() if state is None]
    return min(bad, default=None)


class Reference:
    """What `kripke.product_search.Product` is, in plain Python."""

    def __init__(self, graph: Graph, readers: Sequence[Reader], fair_bits: Sequence[int]) -> None:
        self._graph = graph
        self._readers = readers
        self._fair = fair_bits
        self.sets = sum(r.automaton.acceptance_sets for r in readers) + len(fair_bits)

    def step(self, states: States, letter: int) -> Iterator[tuple[int, States]]:
        each = []
        for reader, state in zip(self._readers, states, strict=True):
            mine = reader.project(letter)
            each.append([(e.acceptance, e.target) for e in reader.automaton.edges[state] if e.allows(mine)])
        fair = [letter >> bit & 1 for bit in self._fair]
        for joint in product(*each):
            mask, shift = 0, 0
            for (acceptance, _), reader in zip(joint, self._readers, strict=True):
                mask |= acceptance << shift
                shift += reader.automaton.acceptance_sets
            yield mask | sum(bit << (shift + i) for i, bit in enumerate(fair)), tuple(t for _, t in joint)

    def starts(self, first: Sequence[int]) -> list[Node]:
        if any(not r.automaton.edges for r in self._readers):
            return []
        begin = (0,) * len(self._readers)
        return [(root, s) for root in range(self._graph.roots) for _, s in self.step(begin, first[root])]

    def edges(self, node: Node) -> Iterator[tuple[int, int, Node]]:
        """Letters (0 or 1), acceptance and target."""
        for target, letter in self._graph.edges(node[0]):
            if letter is None:
                yield 0, 0, (target, node[1])
            else:
                for acceptance, states in self.step(node[1], letter):
                    yield 1, acceptance, (target, states)

    def has_lasso(self, starts: Sequence[Node]) -> bool:
        return find_accepting_lasso(starts, self.edges, self.sets) is not None

    def shortest_lasso(self, starts: Sequence[Node]) -> int | None:
        """Letters of a shortest stem and loop; None: there is none."""
        full = (1 << self.sets) - 1
        best: int | None = None
        stems = distances(starts, lambda n: ((letters, target) for letters, _, target in self.edges(n)))
        for entry, far in stems.items():

            def seen(node: tuple[Node, int, bool]) -> Iterator[tuple[int, tuple[Node, int, bool]]]:
                for letters, acceptance, target in self.edges(node[0]):
                    yield letters, (target, node[1] | acceptance, True)

            back = distances([(entry, 0, False)], seen).get((entry, full, True))
            if back is not None and (best is None or far + back < best):
                best = far + back
        return best

    def continued_bad_prefix(self, first: Sequence[int], monitor: BadPrefix, project: Projection) -> int | None:
        """Letters of a shortest bad prefix from the end of which there is a lasso; None: there is none."""
        begin = monitor.initial()

        def after(state: int | None, letter: int) -> int | None:
            return None if state is None else monitor.step(state, project(letter))

        def edges(node: tuple[Node, int | None]) -> Iterator[tuple[int, tuple[Node, int | None]]]:
            (at, states), watch = node
            for target, letter in self._graph.edges(at):
                if letter is None:
                    yield 0, ((target, states), watch)
                else:
                    for _, following in self.step(states, letter):
                        yield 1, ((target, following), after(watch, letter))

        starts = [(n, after(begin, first[n[0]])) for n in self.starts(first)]
        found = distances(starts, edges)
        return min((far for (n, watch), far in found.items() if watch is None and self.has_lasso([n])), default=None)
