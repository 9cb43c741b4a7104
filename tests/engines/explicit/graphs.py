"""Random small graphs for the searches, and what a walk through one has to be."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

from hypothesis import strategies as st

from llfsm_verify.kripke.graph import EPSILON, Graph
from llfsm_verify.kripke.product import Sizes
from llfsm_verify.kripke.product_search import Projection, Walk
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.lasso import evaluate

KEYS = ("p", "q")
FAIR = len(KEYS)
"""The bit behind the atoms' bits is a fairness condition."""

TINY = Sizes(portion=3, entries=1, slots=2)
"""Every array grows, and the kernels return often."""
SPARSE = Sizes(portion=7, entries=2, slots=2, dense_bytes=0, dense_states=0)
"""Product nodes are numbered from the beginning."""
THINNED = Sizes(portion=5, entries=2, slots=2, dense_bytes=0, dense_states=1)
"""They are from when the automaton has a second state."""
BLIND = Sizes(rows=0)
"""Nothing is known of the automaton beforehand."""
SIZES = (Sizes(), TINY, SPARSE, THINNED, BLIND)

Edges = Sequence[Sequence[tuple[int, int | None]]]


def made(edges: Edges, roots: int = 1) -> Graph:
    """A graph from the (target, letter) pairs of each node."""
    alphabet = sorted({letter for row in edges for _, letter in row if letter is not None})
    return of_edges([[(t, None if x is None else alphabet.index(x)) for t, x in row] for row in edges], alphabet, roots)


@st.composite
def graphs(draw: st.DrawFn, largest: int = 6, *, silent: bool = True) -> tuple[Graph, list[int]]:
    """A graph whose edges carry letters of two atoms and a fairness bit, perhaps none; and the roots' first letters.

    Edges without a letter lead to higher numbers, so that no loop is without letters. The last nodes may be without
    edges, as in a graph that is not explored to its end.
    """
    size = draw(st.integers(1, largest))
    letter = st.integers(0, (1 << (FAIR + 1)) - 1)
    rows: list[list[tuple[int, int | None]]] = []
    for i in range(size):
        shown: st.SearchStrategy[tuple[int, int | None]] = st.tuples(st.integers(0, size - 1), letter)
        if silent and i + 1 < size:
            shown = shown | st.tuples(st.integers(i + 1, size - 1), st.none())
        rows.append(draw(st.lists(shown, min_size=1, max_size=3, unique=True)))
    roots = draw(st.integers(1, min(size, 2)))
    graph = made(rows, roots)
    graph.expanded = draw(st.integers(max(1, size - 2), size))
    first = draw(st.lists(st.integers(0, (1 << FAIR) - 1), min_size=roots, max_size=roots))
    return graph, first


def projection(formula: Formula) -> tuple[tuple[str, ...], Projection]:
    names = tuple(sorted(atoms(formula)))
    return names, Projection([KEYS.index(n) for n in names])


def follows(graph: Graph, walk: Walk) -> bool:
    """It is a walk through the graph from a root, and its loop is one."""
    steps = zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False)
    return (
        len(walk.letters) == len(walk.nodes) - 1
        and walk.nodes[0] < graph.roots
        and all((t, x) in set(graph.edges(n)) for n, t, x in steps)
        and (walk.loop is None or walk.nodes[walk.loop] == walk.nodes[-1])
    )


def word(walk: Walk, first: Sequence[int]) -> tuple[list[int], list[int]]:
    """The letters of the stem, the first one with them, and of the loop."""
    stem = len(walk.letters) if walk.loop is None else walk.loop
    shown = [x for x in walk.letters[:stem] if x is not None]
    return [first[walk.nodes[0]], *shown], [x for x in walk.letters[stem:] if x is not None]


def satisfies(formula: Formula, stem: Sequence[int], loop: Sequence[int]) -> bool:
    """By the definition, without automata."""
    return evaluate(formula, [names(x) for x in stem], [names(x) for x in loop])


def names(letter: int) -> frozenset[str]:
    """The atoms of a letter."""
    return frozenset(k for i, k in enumerate(KEYS) if letter >> i & 1)


def of_edges(edges: Sequence[Sequence[tuple[int, int | None]]], alphabet: Sequence[int], roots: int) -> Graph:
    """A complete graph from the (successor, label) pairs of each node, label None for `EPSILON`. The key of node i is
    the number i."""
    graph = Graph(words=1, configuration_bytes=8, roots=roots, alphabet=list(alphabet))
    graph.count = graph.expanded = graph.configurations = len(edges)
    first, targets, labels = array("q", [0]), array("I"), array("I")
    for pairs in edges:
        for target, label in pairs:
            targets.append(target)
            labels.append(EPSILON if label is None else label)
        first.append(len(targets))
    graph.edge_count = len(targets)
    graph.has_silent_edges = EPSILON in labels
    graph.transitions = sum(len({t for t, _ in pairs}) for pairs in edges)
    graph.keys.write(array("q", range(len(edges))).tobytes())
    graph.parents.write(array("I", range(len(edges))).tobytes())
    for region, data in ((graph.first, first), (graph.targets, targets), (graph.labels, labels)):
        region.write(data.tobytes())
    graph.complete = True
    return graph
