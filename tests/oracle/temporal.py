"""LTL on every fair run of a graph, by guessing at each letter which subformulas hold.

The declarative tableau of the literature (Lichtenstein and Pnueli, POPL 1985): the guesses must agree from letter to
letter, and what is awaited must come. Nothing of `llfsm_verify.automata` or `llfsm_verify.logic` is used.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import networkx as nx

from tests.oracle.formulas import BINARY, UNARY, Tree, parts
from tests.oracle.graph import Graph, Letter

Truth = tuple[bool, ...]
"""Of all subformulas, in their order."""


class Search:
    """Is there a fair run on which `formula` holds? `fair`: each process that has not ended steps again and again."""

    def __init__(self, formula: Tree, graph: Graph, *, fair: bool) -> None:
        self._nodes = list(dict.fromkeys(parts(formula)))
        self._number = {f: i for i, f in enumerate(self._nodes)}
        self._temporal = [i for i, f in enumerate(self._nodes) if f[0] in (*UNARY, *BINARY)]
        self._names = frozenset(f[1] for f in self._nodes if f[0] == "atom")
        self._graph, self._fair = graph, fair

    @cache  # noqa: B019 - a search is used once
    def _truths(self, letter: Letter) -> list[Truth]:
        found = []
        for guess in product((False, True), repeat=len(self._temporal)):
            guessed = dict(zip(self._temporal, guess, strict=True))
            truth: list[bool] = []
            for i, f in enumerate(self._nodes):
                args = [truth[self._number[a]] for a in f[1:] if isinstance(a, tuple)]
                match f[0]:
                    case "atom":
                        truth.append(f[1] in letter)
                    case "true":
                        truth.append(True)
                    case "!":
                        truth.append(not args[0])
                    case "&&":
                        truth.append(all(args))
                    case "||":
                        truth.append(any(args))
                    case "->":
                        truth.append(not args[0] or args[1])
                    case _:
                        truth.append(guessed[i])
            found.append(tuple(truth))
        return found

    def _args(self, i: int) -> tuple[int, int]:
        """The numbers of the arguments of a temporal subformula; the one of a unary operator twice."""
        f = self._nodes[i]
        return self._number[f[1]], self._number[f[-1]]

    def _agrees(self, now: Truth, later: Truth) -> bool:
        for i in self._temporal:
            first, second = self._args(i)
            a, b, again = now[first], now[second], later[i]
            expected = {
                "X": later[first], "F": a or again, "G": a and again, "U": b or (a and again), "W": b or (a and again),
                "R": b and (a or again), "M": b and (a or again),
            }[self._nodes[i][0]]  # fmt: skip
            if now[i] != expected:
                return False
        return True

    @cache  # noqa: B019
    def _followers(self, now: Truth, letter: Letter) -> list[Truth]:
        return [later for later in self._truths(letter) if self._agrees(now, later)]

    def _not_put_off(self, i: int, now: Truth) -> bool:
        """Here a subformula is true because of this letter, or false because of it, or one that may wait forever."""
        first, second = self._args(i)
        a, b = now[first], now[second]
        op = self._nodes[i][0]
        if op in ("F", "U", "M"):
            return not now[i] or {"F": a, "U": b, "M": a and b}[op]
        return op == "X" or now[i] or {"G": not a, "W": not a and not b, "R": not b}[op]

    def found(self) -> bool:
        """Whether there is such a run."""
        whole = len(self._nodes) - 1
        runs = nx.DiGraph()
        moved: dict[tuple[object, object], list[frozenset[int]]] = {}
        todo = []
        for root, letter in self._graph.roots:
            todo += [(root, truth) for truth in self._truths(letter & self._names) if truth[whole]]
        seen = set(todo)
        while todo:
            node = todo.pop()
            c, truth = node
            for edge in self._graph.edges[c]:
                for later in self._followers(truth, edge.letter & self._names):
                    target = (edge.target, later)
                    runs.add_edge(node, target)
                    moved.setdefault((node, target), []).append(edge.moved)
                    if target not in seen:
                        seen.add(target)
                        todo.append(target)
        for component in nx.strongly_connected_components(runs):
            inside = [pair for node in component for pair in runs.out_edges(node) if pair[1] in component]
            if inside and self._accepts(component, [m for pair in inside for m in moved[pair]]):
                return True
        return False

    def _accepts(self, component: set[tuple[object, Truth]], moves: list[frozenset[int]]) -> bool:
        truths = {truth for _, truth in component}
        if not all(any(self._not_put_off(i, truth) for truth in truths) for i in self._temporal):
            return False
        (ended,) = {tuple(p.ended for p in c.processes) for c, _ in component}  # nothing that has ended goes on
        return not self._fair or all(over or any(i in m for m in moves) for i, over in enumerate(ended))
