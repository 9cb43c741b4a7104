"""Where an arrangement escapes its assumptions, by the definition in docs/semantics.md, in plain Python."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import reduce
from itertools import chain, combinations

import networkx as nx

from tests.oracle.formulas import Tree, atoms
from tests.oracle.graph import Configuration, Graph, Letter
from tests.oracle.temporal import Search, Truth

Node = tuple[Configuration, Truth]
TRUE: Tree = ("true",)


def conjunction(formulas: Sequence[Tree]) -> Tree:
    return reduce(lambda f, g: ("&&", f, g), formulas, TRUE)


class _Assumed(Search):
    """What the assumptions may still come to: the guesses of the tableau after each letter."""

    def __init__(self, formula: Tree, graph: Graph, *, fair: bool) -> None:
        super().__init__(formula, graph, fair=fair)
        self._live: set[Node] | None = None
        self._open: dict[tuple[frozenset[str], frozenset[str]], set[Truth]] = {}

    def first(self, letter: Letter) -> frozenset[Truth]:
        return frozenset(truth for truth in self._truths(letter & self._names) if truth[-1])

    def after(self, truths: frozenset[Truth], letter: Letter) -> frozenset[Truth]:
        seen = letter & self._names
        return frozenset(later for truth in truths for later in self._followers(truth, seen))

    def goes_on(self, configuration: Configuration, truths: Iterable[Truth]) -> bool:
        """Whether some fair run from a configuration agrees with one of the guesses."""
        if self._live is None:
            self._live = self._all_live()
        return any((configuration, truth) in self._live for truth in truths)

    def _all_live(self) -> set[Node]:
        runs, moved = nx.DiGraph(), dict[tuple[Node, Node], list[frozenset[int]]]()
        todo = [(root, truth) for root, letter in self._graph.roots for truth in self.first(letter)]
        seen = set(todo)
        while todo:
            node = todo.pop()
            runs.add_node(node)
            for edge in self._graph.edges[node[0]]:
                for later in self.after(frozenset((node[1],)), edge.letter):
                    target = (edge.target, later)
                    runs.add_edge(node, target)
                    moved.setdefault((node, target), []).append(edge.moved)
                    if target not in seen:
                        seen.add(target)
                        todo.append(target)
        live: set[Node] = set()
        for component in nx.strongly_connected_components(runs):
            inside = [pair for node in component for pair in runs.out_edges(node) if pair[1] in component]
            if inside and self._accepts(component, [m for pair in inside for m in moved[pair]]):
                live |= component
        backward = runs.reverse(copy=False)
        return set(chain(live, *(nx.descendants(backward, node) for node in live)))

    def can_be_met(self, truths: Iterable[Truth], fixed: Collection[str], last: Letter) -> bool:
        """Whether some word, of any arrangement, agrees with one of the guesses; atoms of `fixed` stay as in `last`."""
        kept = frozenset(fixed) & self._names
        key = kept, last & kept
        if key not in self._open:
            self._open[key] = self._words(kept, last & kept)
        return any(truth in self._open[key] for truth in truths)

    def _words(self, kept: frozenset[str], on: frozenset[str]) -> set[Truth]:
        others = sorted(self._names - kept)
        letters = [on | set(some) for n in range(len(others) + 1) for some in combinations(others, n)]
        words = nx.DiGraph()
        for letter in letters:
            for truth in self._truths(letter):
                words.add_node(truth)
                words.add_edges_from((truth, later) for other in letters for later in self._followers(truth, other))
        found: set[Truth] = set()
        for component in nx.strongly_connected_components(words):
            inside = any(words.has_edge(a, b) for a in component for b in component)
            if inside and all(any(self._not_put_off(i, truth) for truth in component) for i in self._temporal):
                found |= component
        backward = words.reverse(copy=False)
        return set(chain(found, *(nx.descendants(backward, truth) for truth in found)))


def nearest_escape(
    assumptions: Sequence[Tree], graph: Graph, inputs: Collection[str], fixed: Collection[str], *, fair: bool
) -> int | None:
    """The letters after the first one of the nearest escape; None: there is none, or no run meets the assumptions.

    `inputs` are the atoms about inputs only, `fixed` those about inputs that never change."""
    about_inputs = [f for f in assumptions if set(atoms(f)) <= set(inputs)]
    everything = _Assumed(conjunction(assumptions), graph, fair=fair)
    outside = _Assumed(conjunction(about_inputs), graph, fair=fair)
    layer = {(root, everything.first(letter), outside.first(letter), letter) for root, letter in graph.roots}
    if not any(everything.goes_on(c, truths) for c, truths, _, _ in layer):
        return None
    seen, count = set(layer), 0
    while layer:
        for c, truths, others, letter in layer:
            escaped = not everything.goes_on(c, truths) and everything.can_be_met(truths, fixed, letter)
            if escaped and outside.goes_on(c, others):
                return count
        layer = {
            (edge.target, everything.after(truths, edge.letter), outside.after(others, edge.letter), edge.letter)
            for c, truths, others, _ in layer
            for edge in graph.edges[c]
        } - seen
        seen |= layer
        count += 1
    return None
