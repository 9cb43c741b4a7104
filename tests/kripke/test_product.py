"""The kernels of the product by themselves: components against networkx, distances, stores and their limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.kernels import product_blocks
from llfsm_verify.kripke.paths import Breadth, Components, Living, SearchTarget
from llfsm_verify.kripke.product import NO_STATE, EdgeClasses, Move, Rows, Sizes
from llfsm_verify.limits import LimitReached
from tests.engines.explicit.graphs import of_edges
from tests.quick import examples

SETS = 2
TINY = Sizes(portion=3, entries=1, slots=2)
SPARSE = Sizes(portion=2, entries=1, slots=2, dense_bytes=0, dense_states=0)
THINNED = Sizes(portion=2, entries=1, slots=2, dense_bytes=0, dense_states=1)
ALL = (Sizes(), TINY, SPARSE, THINNED)

Edges = list[tuple[int, int, int]]


def rows(graph: Graph, step: Callable[[int, int], Iterable[Move]]) -> Rows:
    return Rows(EdgeClasses(graph, -1), step)


def made(size: int, edges: Edges) -> Graph:
    """A graph in which an edge's letter is its acceptance."""
    return of_edges([[(b, mask) for a, mask, b in edges if a == i] for i in range(size)], range(1 << SETS), 1)


@st.composite
def cases(draw: st.DrawFn) -> tuple[int, Edges]:
    size = draw(st.integers(1, 8))
    edge = st.tuples(st.integers(0, size - 1), st.integers(0, (1 << SETS) - 1), st.integers(0, size - 1))
    return size, draw(st.lists(edge, max_size=16, unique=True))


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(cases(), st.sampled_from(ALL), st.integers(0, SETS), st.booleans())
def test_marked_are_the_nodes_of_accepting_components(
    case: tuple[int, Edges], sizes: Sizes, sets: int, twice: bool
) -> None:
    """With an automaton that does nothing, or that goes to another state at each edge."""
    size, edges = case
    full = (1 << sets) - 1
    graph = made(size, edges)
    states = 2 if twice else 1
    whole = nx.MultiDiGraph()
    whole.add_nodes_from((n, q) for n in range(size) for q in range(states))
    whole.add_edges_from(
        ((a, q), (b, (q + 1) % states), {"mask": mask & full}) for a, mask, b in edges for q in range(states)
    )
    accepting = set()
    for component in nx.strongly_connected_components(whole):
        inside = [d["mask"] for _, _, d in whole.subgraph(component).edges(data=True)]
        if inside and full == _joined(inside):
            accepting |= component
    reached = {(0, 0)} | nx.descendants(whole, (0, 0))

    def step(state: int, letter: int) -> tuple[Move, ...]:
        return (((state + 1) % states, letter & full),)

    with rows(graph, step) as moves, Components(graph, moves, sets, sizes) as components:
        found = components.search([(0, 0)])
        assert found == bool(accepting & reached)
        if not found:
            return
        components.collect(1 << 30)
        marks = components, list(range(states))
        with Breadth(graph, moves, [(0, 0)], goal=SearchTarget.ACCEPTING, marks=marks, sizes=sizes) as search:
            order = []
            while (number := search.next()) is not None:
                order.append((search.node(number), search.distance))
        assert {node for node, _ in order} == accepting & reached
        lengths = nx.single_source_shortest_path_length(whole, (0, 0))
        assert [far for _, far in order] == sorted(lengths[node] for node, _ in order)
        assert all(lengths[node] == far for node, far in order)


def _joined(masks: Iterable[int]) -> int:
    joined = 0
    for mask in masks:
        joined |= mask
    return joined


@pytest.mark.parametrize("sizes", ALL)
def test_searches_go_on_from_more_starts(sizes: Sizes) -> None:
    """Two rings: nothing is searched twice, and what was found in vain stays so."""
    graph = of_edges([[(1, 0)], [(0, 0)], [(3, 0)], [(2, 1)]], [0, 1], 1)
    with (
        rows(graph, lambda state, letter: ((state, letter),)) as moves,
        Breadth(graph, moves, [(0, 0)], goal=SearchTarget.NOTHING, sizes=sizes) as reached,
    ):
        with Components(graph, moves, 1, sizes) as components:
            assert reached.next() is None and reached.found == 2
            assert not components.search_found(reached, [0])
            work = components.work
            assert not components.search_found(reached, [0])
            assert components.work == work
            reached.start([(1, 0), (2, 0), (2, 0)])
            assert reached.next() is None and reached.found == 4
            assert components.search_found(reached, [0])
        with Components(graph, moves, 1, sizes) as components:
            assert not components.search_found(reached, [NO_STATE])


def test_a_row_of_too_many_moves_is_a_limit() -> None:
    graph = of_edges([[(0, 0)]], [0], 1)
    with (
        rows(graph, lambda _, __: ((i, 0) for i in range(1 << 16))) as moves,
        Components(graph, moves, 0) as components,
        pytest.raises(LimitReached, match="65,535 moves"),
    ):
        components.search([(0, 0)])


@pytest.mark.parametrize("sizes", [TINY, SPARSE])
def test_more_product_nodes_than_have_numbers_are_a_limit(monkeypatch: pytest.MonkeyPatch, sizes: Sizes) -> None:
    monkeypatch.setattr(product_blocks, "MOST_NODES", 16)
    graph = of_edges([[(i + 1, 0)] for i in range(100)] + [[(0, 0)]], [0], 1)
    with rows(graph, lambda state, _: ((state, 0),)) as moves:
        with Components(graph, moves, 1, sizes) as components, pytest.raises(LimitReached, match="more than"):
            components.search([(0, 0)])
        with (
            Breadth(graph, moves, [(0, 0)], goal=SearchTarget.NOTHING, sizes=sizes) as search,
            pytest.raises(LimitReached, match="more than"),
        ):
            search.next()


@pytest.mark.parametrize("sets", [-1, 63])
def test_sets_that_do_not_fit_a_word_are_refused(sets: int) -> None:
    graph = of_edges([[(0, 0)]], [0], 1)
    with rows(graph, lambda state, _: ((state, 0),)) as moves, pytest.raises(ValueError, match=str(sets)):
        Components(graph, moves, sets)


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(cases(), st.sampled_from(ALL), st.integers(0, SETS), st.booleans())
def test_lost_are_the_nodes_that_reach_no_accepting_component(
    case: tuple[int, Edges], sizes: Sizes, sets: int, twice: bool
) -> None:
    size, edges = case
    full = (1 << sets) - 1
    graph = made(size, edges)
    states = 2 if twice else 1
    whole = nx.MultiDiGraph()
    whole.add_nodes_from((n, q) for n in range(size) for q in range(states))
    whole.add_edges_from(
        ((a, q), (b, (q + 1) % states), {"mask": mask & full}) for a, mask, b in edges for q in range(states)
    )
    live = set()
    for component in nx.strongly_connected_components(whole):
        inside = [d["mask"] for _, _, d in whole.subgraph(component).edges(data=True)]
        if inside and full == _joined(inside):
            live |= set.union(component, *(nx.ancestors(whole, node) for node in component))
    reached = {(0, 0)} | nx.descendants(whole, (0, 0))

    def step(state: int, letter: int) -> tuple[Move, ...]:
        return (((state + 1) % states, letter & full),)

    with rows(graph, step) as moves, Components(graph, moves, sets, sizes) as components:
        if not components.search([(0, 0)]):
            assert not live & reached
            return
        components.collect(1 << 60)
        with Living(graph, moves, [(0, 0)], components, sizes) as living:
            living.sweep()
            for watched in ([1] * states, [0] * (states - 1) + [1]):
                lost = [living.node(number) for number in living.lost(watched)]
                wanted = {node for node in reached - live if watched[node[1]]}
                assert len(lost) == len(set(lost)) and set(lost) == wanted
                distances = [nx.shortest_path_length(whole, (0, 0), node) for node in lost]
                assert distances == sorted(distances)
