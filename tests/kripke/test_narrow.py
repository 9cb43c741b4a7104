"""Narrow graphs: the edges stored are those of the whole graph with letters that are kept, for any number of jobs."""

from __future__ import annotations

import importlib.util
from array import array
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.narrow import Keeps, _Compact, keeps_of, narrow_lasso
from llfsm_verify.kripke.product_search import Projection, Reader, Walk, accepting_lasso
from llfsm_verify.limits import Budget, LimitReached, Limits, endless_budget
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from tests.quick import examples

spec = importlib.util.spec_from_file_location("ring", Path(__file__).parents[2] / "benchmarks" / "ring.py")
assert spec is not None
assert spec.loader is not None
benchmark = importlib.util.module_from_spec(spec)
spec.loader.exec_module(benchmark)

Arc = tuple[int, int, int]
"""Source, target and letter."""


def numbers(graph: Graph, name: str) -> array[int]:
    return array("I", getattr(graph, name).read(0, 4 * graph.edge_count))


def stored(graph: Graph) -> list[Arc]:
    letters = (graph.alphabet[label] for label in numbers(graph, "labels"))
    return list(zip(numbers(graph, "sources"), numbers(graph, "targets"), letters, strict=True))


def all_edges(graph: Graph) -> list[Arc]:
    first = array("q", graph.first.read(0, 8 * (len(graph) + 1)))
    sources = [node for node in range(len(graph)) for _ in range(first[node], first[node + 1])]
    letters = (graph.alphabet[label] for label in numbers(graph, "labels"))
    return list(zip(sources, numbers(graph, "targets"), letters, strict=True))


def explored(jobs: int, nodes: int | None) -> Explorer:
    """`nodes`: the graph becomes narrow when there are so many."""
    arrangement = load_arrangement_text(benchmark.ring(5, 3))
    lines = parse_properties([Source("p.ltl", "p: G (m0@ON && !m1@ON || m3@ON && m4@ON -> F m2@ON)")])
    explorer = Explorer(
        lower(arrangement, bind(arrangement, lines).atoms, keep_all_bits=True), endless_budget(), jobs=jobs
    )
    if nodes is not None:
        explorer.explore(nodes)
        assert explorer.narrow(keeps)
    explorer.explore(None)
    assert explorer.graph.complete
    return explorer


def keeps(letter: int) -> bool:
    return letter % 3 == 1


@pytest.mark.slow
def test_the_edges_that_are_kept() -> None:
    whole = explored(1, None)
    kept = [edge for edge in all_edges(whole.graph) if keeps(edge[2])]
    assert 0 < len(kept) < whole.graph.edge_count / 2
    for jobs, nodes in ((1, 10), (1, 1_000), (2, 1_000), (3, 100_000)):
        narrow = explored(jobs, nodes)
        assert stored(narrow.graph) == kept
        assert (len(narrow.graph), narrow.graph.transitions) == (len(whole.graph), whole.graph.transitions)
        narrow.close()
    whole.close()


def test_a_deep_graph_is_made_compact() -> None:
    """A node for each of 50,000 distances, some of which have no nodes with edges; the time limit is looked at."""
    nodes = 50_000
    parents = array("I", [0, *range(nodes - 1)])
    sources = array("I", range(0, nodes - 1, 7))
    targets = array("I", (source + 1 for source in sources))
    graph = Graph(1, 8, with_edges=False, is_narrow=True, roots=1, count=nodes, expanded=nodes, alphabet=[0, 1])
    graph.edge_count = len(sources)
    for region, column in ((graph.parents, parents), (graph.sources, sources), (graph.targets, targets)):
        region.write(column.tobytes())
    graph.labels.write(bytes(4 * len(sources)))
    made = _Compact(graph, 4)
    found = made.graph
    far, arcs = len(sources), [list(found.arcs(node)) for node in range(found.count)]
    assert made.nodes.tolist() == sources.tolist()
    assert found.count == far + nodes - 1
    for distance in range(1, nodes):
        at_it = [(distance // 7, 2)] if distance % 7 == 0 and distance < nodes - 1 else []
        farther = [(far + distance, 2)] if distance < nodes - 1 else []
        assert arcs[far + distance - 1] == [*at_it, *farther]
    with Budget(Limits(timeout=0)), pytest.raises(LimitReached):
        _Compact(graph, 4)
    made.close()
    graph.close()


# ---------------------------------------------------------------- lassos, of random graphs and automata that wait

SMALL = 1, 8
"""Words of a node, and bytes of a configuration."""


def automaton(rng: Random) -> Automaton:
    """One that waits in its first state, with two atoms."""

    def moves(targets: list[int], sets: int) -> tuple[Edge, ...]:
        masks = [rng.choice(((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 2), (3, 0))) for _ in targets]
        return tuple(Edge(*mask, to, rng.randrange(1 << sets)) for mask, to in zip(masks, targets, strict=True))

    states, sets = rng.randint(2, 4), rng.randint(1, 2)
    others = range(1, states)
    begin = Edge(0, 0, 0, 0), *moves(rng.choices(others, k=rng.randint(1, 2)), sets)
    rest = [moves(rng.choices(others, k=rng.randint(1, 2)), sets) for _ in others]
    return Automaton(("a", "b"), (begin, *rest), sets)


def breadth_first(rng: Random) -> tuple[Graph, list[list[tuple[int, int]]]]:
    """A graph, its nodes in the order in which they are found, and its edges; some nodes have none."""
    wanted, letters, roots = rng.randint(2, 25), rng.sample(range(4), rng.randint(1, 4)), rng.randint(1, 2)
    parents, edges = list(range(roots)), list[list[tuple[int, int]]]()
    for node in range(wanted):
        if node == len(parents):
            break
        arcs = []
        for _ in range(rng.randint(0 if rng.random() < 0.2 else 1, 3)):
            target = len(parents) if len(parents) < wanted and rng.random() < 0.6 else rng.randrange(len(parents))
            if target == len(parents):
                parents.append(node)
            arcs.append((target, rng.randrange(len(letters))))
        edges.append(list(dict.fromkeys(arcs)))
    graph = Graph(*SMALL, roots=roots, count=len(parents), expanded=len(edges), alphabet=letters)
    graph.parents.write(array("I", parents).tobytes())
    offsets = [0]
    for arcs in edges:
        offsets.append(offsets[-1] + len(arcs))
    flat = [arc for arcs in edges for arc in arcs]
    graph.edge_count = len(flat)
    graph.first.write(array("q", offsets).tobytes())
    graph.targets.write(array("I", [target for target, _ in flat]).tobytes())
    graph.labels.write(array("I", [label for _, label in flat]).tobytes())
    return graph, edges


def narrowed(graph: Graph, edges: list[list[tuple[int, int]]], keeps: Keeps) -> Graph:
    """The same graph with the edges that are kept."""
    found = Graph(*SMALL, with_edges=False, is_narrow=True, roots=graph.roots, alphabet=graph.alphabet)
    found.count, found.expanded = graph.count, graph.expanded
    found.parents.write(graph.parents.read(0, 4 * graph.count))
    kept = [(node, *arc) for node, arcs in enumerate(edges) for arc in arcs if keeps(graph.alphabet[arc[1]])]
    found.edge_count = len(kept)
    for place, region in enumerate((found.sources, found.targets, found.labels)):
        region.write(array("I", [edge[place] for edge in kept]).tobytes())
    return found


def is_run(walk: Walk, reader: Reader, graph: Graph, edges: list[list[tuple[int, int]]], first: list[int]) -> bool:
    """Whether a walk is one of a graph, and accepted."""
    assert walk.loop is not None
    steps = list(zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False))
    if walk.nodes[0] >= graph.roots or walk.nodes[walk.loop] != walk.nodes[-1]:
        return False
    if not all((target, letter) in [(t, graph.alphabet[n]) for t, n in edges[node]] for node, target, letter in steps):
        return False
    letters = sorted({letter for letter in walk.letters if isinstance(letter, int)})
    line = Graph(*SMALL, roots=1, count=len(steps), expanded=len(steps), alphabet=letters)
    line.edge_count = len(steps)
    line.first.write(array("q", range(len(steps) + 1)).tobytes())
    line.targets.write(array("I", [*range(1, len(steps)), walk.loop]).tobytes())
    line.labels.write(array("I", [letters.index(letter) for *_, letter in steps]).tobytes())  # type: ignore[arg-type]
    return accepting_lasso(line, [first[walk.nodes[0]]], [reader], ()) is not None


@pytest.mark.slow
def test_lassos_are_those_of_the_whole_graph() -> None:
    met = Counter[str]()
    for number in range(examples(1_200)):
        rng = Random(number)
        (graph, edges), reader = breadth_first(rng), Reader(automaton(rng), Projection((0, 1)))
        keeps = keeps_of(reader)
        assert keeps is not None
        first = [rng.randrange(4) for _ in range(graph.roots)]
        whole = accepting_lasso(graph, first, [reader], ())
        narrow = narrowed(graph, edges, keeps)

        def shown(source: int, target: int, edges: list[list[tuple[int, int]]] = edges, graph: Graph = graph) -> int:
            return next(graph.alphabet[label] for to, label in edges[source] if to == target)

        found = narrow_lasso(narrow, first, reader, 2, shown)
        assert (found is None) == (whole is None), number
        if found is not None and whole is not None:
            assert len(found.nodes) == len(whole.nodes), number
            assert is_run(found, reader, graph, edges, first), number
        met["none" if found is None else "short" if len(found.nodes) < 4 else "long"] += 1
        graph.close()
        narrow.close()
    assert min(met[each] for each in ("none", "short", "long")) > 10


def test_automata_that_do_not_wait() -> None:
    def waits(*rows: tuple[Edge, ...], sets: int = 1) -> bool:
        return keeps_of(Reader(Automaton(("a", "b"), rows, sets), Projection((0, 1)))) is not None

    stays, leaves, accepts = Edge(0, 0, 0, 0), Edge(1, 0, 1, 0), (Edge(2, 0, 1, 1),)
    assert waits((stays, leaves), accepts)
    assert waits((stays, Edge(2, 0, 0, 0), leaves), accepts)
    assert not waits((stays, leaves), accepts, sets=0)  # waiting is accepted
    assert not waits((stays, Edge(2, 0, 0, 1), leaves), accepts)
    assert not waits((Edge(1, 0, 0, 0), leaves), accepts)
    assert not waits((stays, leaves), (*accepts, Edge(1, 0, 0, 0)))
    assert not waits((leaves,), accepts)
    assert not waits()
