"""Narrow graphs: the edges stored are those of the whole graph with letters that are kept, for any number of jobs."""

from __future__ import annotations

import importlib.util
from array import array
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.narrow import _Compact
from llfsm_verify.limits import Budget, LimitReached, Limits, endless_budget
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower

spec = importlib.util.spec_from_file_location("ring", Path(__file__).parents[2] / "benchmarks" / "ring.py")
assert spec is not None
assert spec.loader is not None
benchmark = importlib.util.module_from_spec(spec)
spec.loader.exec_module(benchmark)

Edge = tuple[int, int, int]
"""Source, target and letter."""


def numbers(graph: Graph, name: str) -> array[int]:
    return array("I", getattr(graph, name).read(0, 4 * graph.edge_count))


def stored(graph: Graph) -> list[Edge]:
    letters = (graph.alphabet[label] for label in numbers(graph, "labels"))
    return list(zip(numbers(graph, "sources"), numbers(graph, "targets"), letters, strict=True))


def all_edges(graph: Graph) -> list[Edge]:
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
