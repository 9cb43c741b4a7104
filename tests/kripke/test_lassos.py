"""Cores of random automata, and the search that uses them, with automata that no formula would give."""

from __future__ import annotations

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.lassos import Cores
from llfsm_verify.kripke.product import NO_STATE, Sizes
from llfsm_verify.kripke.product_search import Product, Projection, Reader, accepting_lasso
from tests.engines.explicit.graphs import FAIR, KEYS, SIZES, follows, graphs, of_edges, word
from tests.oracle.product import Reference
from tests.quick import examples

LATE = tuple(Sizes(portion=4, entries=1, slots=2, dense_bytes=0, dense_states=n, rows=0) for n in (2, 3))
"""Product nodes are numbered from when the automaton has one state more, in the middle of a search."""
SETS = 2


@st.composite
def automata(draw: st.DrawFn, most: int = 5) -> Automaton:
    """Any automaton over the two atoms; a state may be without moves."""
    size = draw(st.integers(1, most))
    mask = st.integers(0, (1 << len(KEYS)) - 1)
    edge = st.builds(
        lambda seen, value, target, acceptance: Edge(seen & value, seen & ~value, target, acceptance),
        mask,
        mask,
        st.integers(0, size - 1),
        st.integers(0, (1 << SETS) - 1),
    )
    edges = [tuple(draw(st.lists(edge, max_size=4, unique=True))) for _ in range(size)]
    return Automaton(KEYS, tuple(edges), SETS)


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(graphs(8), automata(), st.sampled_from((*SIZES, *LATE)))
def test_lassos_with_any_automaton(case: tuple[Graph, list[int]], automaton: Automaton, sizes: Sizes) -> None:
    graph, first = case
    readers = [Reader(automaton, Projection(range(len(KEYS))))]
    for fair in ([], [FAIR]):
        found = accepting_lasso(graph, first, readers, fair, sizes)
        reference = Reference(graph, readers, fair)
        best = reference.shortest_lasso(reference.starts(first))
        assert (found is None) == (best is None)
        if found is not None:
            assert follows(graph, found)
            stem, loop = word(found, first)
            assert len(stem) - 1 + len(loop) == best


@settings(max_examples=examples(100), deadline=None)
@given(automata(7))
def test_cores_are_the_components_with_all_sets(automaton: Automaton) -> None:
    graph = of_edges([[(0, i) for i in range(1 << len(KEYS))]], range(1 << len(KEYS)), 1)
    product = Product(graph, [Reader(automaton, Projection(range(len(KEYS))))], [])
    start = product.number((0,))
    letters = graph.alphabet
    cores = Cores(product.step, letters, SETS, 1000)
    cores.add([start])

    whole = nx.MultiDiGraph()
    todo = [start]
    whole.add_node(start)
    for state in todo:
        for letter in letters:
            for target, mask in product.step(state, letter):
                if target not in whole:
                    todo.append(target)
                whole.add_edge(state, target, mask=mask)
    expected: dict[int, frozenset[int]] = {}
    for component in nx.strongly_connected_components(whole):
        seen = 0
        for _, _, data in whole.subgraph(component).edges(data=True):
            seen |= data["mask"]
        if seen == (1 << SETS) - 1:
            expected |= dict.fromkeys(component, frozenset(component))
    useful = set(expected).union(*(nx.ancestors(whole, state) for state in expected))

    assert {state for state, number in enumerate(cores.numbers) if number != NO_STATE} == set(expected)
    assert {state for state in whole if cores.is_useful(state)} == useful
    assert cores.single == (set(expected) == set(whole) and len(set(expected.values())) == 1)
    for state in whole:
        for letter in letters:
            moves = product.step(state, letter)
            assert list(cores.toward(state, letter)) == [m for m in moves if m[0] in useful]
            if state in expected:
                inside = [(cores.numbers[t], mask) for t, mask in moves if t in expected[state]]
                assert list(cores.inside(cores.numbers[state], letter)) == inside


def test_too_many_rows_make_every_state_one_of_a_core() -> None:
    automaton = Automaton((), ((Edge(0, 0, 1, 0),), (Edge(0, 0, 1, 1),)), 1)
    graph = of_edges([[(0, 0)]], [0], 1)
    product = Product(graph, [Reader(automaton, Projection([]))], [])
    cores = Cores(product.step, graph.alphabet, 1, 1)
    cores.add([product.number((0,))])
    assert cores.unknown and cores.single and cores.is_useful(0)
    assert list(cores.inside(0, 0)) == list(product.step(0, 0))
