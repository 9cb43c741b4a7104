"""Narrow graphs, which store only the edges that an automaton tells apart from waiting, and accepting lassos in them.

Many automata wait in their initial state: it can stay there whatever letter comes, and never accepts meanwhile. The
negation of ``G (a -> F b)`` does until the `a` that is not answered. Where such an automaton may wait is the whole
graph, and the parents of nodes are shortest ways to it; so the product is searched in the edges with other moves alone
(docs/decisions/0085-narrow-edges.md).
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Callable, Sequence
from contextlib import closing
from itertools import pairwise
from typing import TYPE_CHECKING

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.kripke.graph import FIRST_BYTES, NUMBER_BYTES, Graph, Letters
from llfsm_verify.kripke.lassos import Walk
from llfsm_verify.kripke.product import Move
from llfsm_verify.kripke.product_search import Product, Reader
from llfsm_verify.limits import tick

if TYPE_CHECKING:
    import numpy as np

Keeps = Callable[[int], bool]
"""Whether edges with a letter are stored."""
MOST_KEPT = 0.5
"""Share of the edges above which storing only some does not pay."""


def keeps_of(reader: Reader) -> Keeps | None:
    """The letters with which an automaton does anything else than wait; None: it does not wait."""
    automaton: Automaton | Lazy = reader.automaton
    if not isinstance(automaton, Automaton) or automaton.is_empty or not automaton.acceptance_sets:
        return None
    begin, *others = automaton.edges
    waits = Edge(0, 0, 0, 0) in begin and not any(edge.target == 0 and edge.acceptance for edge in begin)
    if not waits or any(edge.target == 0 for row in others for edge in row):
        return None
    moving = [edge for row in automaton.edges for edge in row if edge.target != 0]
    return lambda letter: any(edge.allows(reader.project(letter)) for edge in moving)


def kept_edges(graph: Graph, expanded: int, edges: int, keeps: Keeps) -> tuple[bytes, bytes, bytes] | None:
    """Sources, targets and labels of the edges whose letters are kept, of those of the first `expanded` nodes; None:
    they are most of them."""
    import numpy as np

    first = np.frombuffer(graph.first.read(0, FIRST_BYTES * expanded), "<i8")
    sources = np.repeat(np.arange(expanded, dtype="<u4"), np.diff(first, append=edges))
    targets, labels = _numbers(graph, "targets", edges), _numbers(graph, "labels", edges)
    kept = np.array([keeps(letter) for letter in graph.alphabet], bool)[labels]
    if kept.sum() > MOST_KEPT * edges:
        return None
    return sources[kept].tobytes(), targets[kept].tobytes(), labels[kept].tobytes()


def _numbers(graph: Graph, name: str, count: int) -> np.ndarray[tuple[int], np.dtype[np.uint32]]:
    import numpy as np

    return np.frombuffer(getattr(graph, name).read(0, NUMBER_BYTES * count), "<u4")


class _Waiting(Product):
    """The product with an automaton that waits, for a graph in which it also reads the letter `silence`, and waits."""

    def __init__(self, graph: Graph, reader: Reader, silence: int) -> None:
        super().__init__(graph, [reader], ())
        self._silence = silence
        self.bits |= silence

    def step(self, state: int, letter: int) -> tuple[Move, ...]:
        if letter == self._silence:
            return ((state, 0),) if self.states(state) == (0,) else ()
        return super().step(state, letter)


def narrow_lasso(
    graph: Graph, first_letters: Sequence[int], reader: Reader, bits: int, shown: Callable[[int, int], int]
) -> Walk | None:
    """What `accepting_lasso` gives, of a narrow graph in which the letters of `keeps_of` are kept; None: there is none.

    `bits`: the number of bits of letters. ``shown(source, target)``: the letter of a step along which nodes are found.
    """
    with closing(_Compact(graph, 1 << bits)) as compact:
        both = _Waiting(compact.graph, reader, 1 << bits)
        numbers = {node: number for number, node in enumerate(compact.nodes[: graph.roots].tolist())}
        starts = [(numbers[node], states) for node, states in both.initial(first_letters) if node in numbers]
        found = both.lasso([*starts, *((node, (0,)) for node in compact.farther)])
        return None if found is None else compact.widened(found, graph, shown)


class _Compact:
    """A narrow graph, its nodes without edges left out, and the others numbered anew: node i is ``nodes[i]``.

    Behind them there is a node for each distance from the roots but 0, with edges to the nodes at that distance and to
    the next of its kind, which show the letter `silence`. So everything is as far as it is in the whole graph.
    """

    def __init__(self, graph: Graph, silence: int) -> None:
        import numpy as np

        sources, targets = _numbers(graph, "sources", graph.edge_count), _numbers(graph, "targets", graph.edge_count)
        labels, is_source = _numbers(graph, "labels", graph.edge_count), np.zeros(len(graph), bool)
        is_source[sources] = True
        nodes = self.nodes = np.flatnonzero(is_source).astype("<u4")
        size = len(nodes)
        inside = is_source[targets]
        parents, begins = array("I", graph.parents.read(0, NUMBER_BYTES * len(graph))), [graph.roots]
        while begins[-1] < len(graph):
            begins.append(bisect_left(parents, begins[-1], begins[-1]))
            tick()
        bounds = np.searchsorted(nodes, begins)
        spans = len(bounds) - 1
        ends = bounds[1:-1] - bounds[0]
        following = np.insert(np.arange(bounds[0], bounds[-1]), ends, np.arange(size + 1, size + spans))
        inner = np.bincount(np.searchsorted(nodes, sources[inside]), minlength=size)
        outer = np.diff(bounds) + 1
        outer[-1:] -= 1
        first = np.concatenate([[0], inner, outer]).astype("<i8").cumsum()
        further = np.full(len(following), len(graph.alphabet), "<u4")
        self.graph = made = Graph(1, 8, roots=graph.roots, alphabet=[*graph.alphabet, silence])
        made.count = made.expanded = size + spans
        made.edge_count = int(first[-1])
        made.first.write(first.tobytes())
        reached = np.concatenate([np.searchsorted(nodes, targets[inside]), following])
        made.targets.write(reached.astype("<u4").tobytes())
        made.labels.write(np.concatenate([labels[inside], further]).tobytes())
        self.farther = range(size, size + min(spans, 1))
        """Where the nodes for distances begin."""

    def widened(self, walk: Walk, graph: Graph, shown: Callable[[int, int], int]) -> Walk:
        """The walk in the whole graph."""
        assert walk.loop is not None
        waited = next(i for i, node in enumerate(walk.nodes) if node < len(self.nodes))
        stem = graph.path_to(int(self.nodes[walk.nodes[waited]]))
        letters: list[Letters] = []
        for step in pairwise(stem):
            letters.append(shown(*step))
            tick()
        rest = [int(self.nodes[node]) for node in walk.nodes[waited + 1 :]]
        loop = walk.loop - waited + len(letters)
        return Walk((*stem, *rest), (*letters, *walk.letters[waited:]), loop)

    def close(self) -> None:
        self.graph.close()
