"""Emptiness agrees with enumerating components, and its lassos are runs with shortest stems."""

from itertools import product

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.limits import ticking
from tests.quick import examples

SETS = 2


@st.composite
def graphs(draw):
    n = draw(st.integers(1, 7))
    edge = st.tuples(st.integers(0, n - 1), st.integers(0, (1 << SETS) - 1), st.integers(0, n - 1))
    return n, draw(st.lists(edge, max_size=14)), draw(st.lists(st.integers(0, n - 1), max_size=3))


def successors(edges):
    return lambda node: [(f"e{i}", mask, b) for i, (a, mask, b) in enumerate(edges) if a == node]


def accepting_nodes(n, edges, initial, full):
    """Nodes of the accepting components that can be reached."""
    graph = nx.MultiDiGraph()
    graph.add_nodes_from(range(n))
    graph.add_edges_from((a, b, {"mask": mask}) for a, mask, b in edges)
    found = set()
    for component in nx.strongly_connected_components(graph):
        masks = [m for a, m, b in edges if a in component and b in component]
        seen = 0
        for mask in masks:
            seen |= mask
        if masks and seen == full and any(nx.has_path(graph, i, next(iter(component))) for i in initial):
            found |= component
    return graph, found


@pytest.mark.slow
@given(graphs(), st.integers(0, SETS))
@settings(max_examples=examples(500), deadline=None)
def test_emptiness_agrees_with_enumeration(case, sets):
    n, edges, initial = case
    full = (1 << sets) - 1
    edges = [(a, mask & full, b) for a, mask, b in edges]
    graph, accepting = accepting_nodes(n, edges, initial, full)
    lasso = find_accepting_lasso(initial, successors(edges), sets)
    assert (lasso is not None) == bool(accepting)
    if lasso is None:
        return
    assert lasso.start in initial and lasso.loop
    node, seen = lasso.start, 0
    for data, target in lasso.stem:
        assert edges[int(data[1:])][::2] == (node, target)
        node = target
    entry = node
    for data, target in lasso.loop:
        assert edges[int(data[1:])][::2] == (node, target)
        seen |= edges[int(data[1:])][1]
        node = target
    assert node == entry and seen == full
    # Quality: nothing of the accepting component is nearer than the stem's end.
    assert entry in accepting
    component = next(c for c in nx.strongly_connected_components(graph) if entry in c)
    loop_nodes = {target for _, target in lasso.loop}
    assert loop_nodes <= component
    distances = [
        nx.shortest_path_length(graph, i, x) for i, x in product(initial, loop_nodes) if nx.has_path(graph, i, x)
    ]
    assert len(lasso.stem) == min(distances) or len(lasso.stem) < min(distances)


def test_the_stem_is_shortest_though_the_search_goes_deep_first():
    # 0 -> 1 -> … -> 9 with a loop at 9, and an edge 0 -> 9 that depth first search would take last.
    edges = [(i, 0, i + 1) for i in range(9)] + [(9, 1, 9), (0, 0, 9)]
    lasso = find_accepting_lasso([0], successors(edges), 1)
    assert [node for _, node in lasso.stem] == [9]
    assert [node for _, node in lasso.loop] == [9]


def test_the_loop_visits_every_set_and_no_more():
    # A ring of six with two sets, and chords that are no use.
    edges = [(i, {1: 1, 4: 2}.get(i, 0), (i + 1) % 6) for i in range(6)] + [(0, 0, 3), (3, 0, 0)]
    lasso = find_accepting_lasso([0], successors(edges), 2)
    assert lasso.stem == ()
    assert len(lasso.loop) == 6


@pytest.mark.parametrize("sets", [0, 1])
def test_no_run_and_no_start(sets):
    assert find_accepting_lasso([], successors([(0, 1, 0)]), sets) is None
    assert find_accepting_lasso([0], successors([(0, 1, 1)]), sets) is None


@pytest.mark.slow
def test_depth_is_no_crash_and_each_node_ticks_once():
    ticks = []
    with ticking(lambda: ticks.append(None)):
        found = find_accepting_lasso([0], lambda i: [(None, 0, i + 1)] if i < 200_000 else [], 1)
    assert found is None
    assert len(ticks) == 200_001


@pytest.mark.slow
@given(graphs())
@settings(max_examples=examples(200), deadline=None)
def test_components_are_those_of_networkx_in_order(case):
    n, edges, _ = case
    targets = [[b for a, _, b in edges if a == i] for i in range(n)]
    numbers = components(targets)
    graph = nx.DiGraph([(a, b) for a, _, b in edges])
    graph.add_nodes_from(range(n))
    expected = {frozenset(c) for c in nx.strongly_connected_components(graph)}
    assert {frozenset(i for i in range(n) if numbers[i] == c) for c in set(numbers)} == expected
    assert all(numbers[b] <= numbers[a] for a, _, b in edges)
