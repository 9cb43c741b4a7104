"""The searches by kernels against plain Python and the definition, on random graphs and formulas."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.safety import BadPrefix, safety
from llfsm_verify.engines.explicit.bad_prefixes import (
    continued_bad_prefix,
    has_continued_bad_prefix,
    shortest_bad_prefix,
)
from llfsm_verify.kripke import lassos
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.product import Sizes
from llfsm_verify.kripke.product_search import (
    Product,
    Projection,
    Reader,
    accepting_lasso,
)
from llfsm_verify.limits import LimitReached, ticking
from llfsm_verify.logic.formula import Formula, apply, atom
from llfsm_verify.testing.formulas import formulas
from tests.engines.explicit.graphs import (
    BLIND,
    FAIR,
    KEYS,
    SIZES,
    SPARSE,
    TINY,
    follows,
    graphs,
    made,
    names,
    projection,
    satisfies,
    word,
)
from tests.oracle.product import Reference, bad_prefix_length
from tests.quick import examples

Case = tuple[Graph, list[int]]
WHOLE = Projection(range(len(KEYS)))


def readers(formula: Formula, assumed: Formula) -> list[Reader]:
    keys, project = projection(formula)
    return [Reader(translate(assumed, KEYS), WHOLE), Reader(translate(formula, keys, negate=True), project)]


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=5), formulas(KEYS, max_leaves=3), st.booleans(), st.sampled_from(SIZES))
def test_lassos_are_found_exactly_where_there_are_some_and_are_shortest(
    case: Case, formula: Formula, assumed: Formula, fair: bool, sizes: Sizes
) -> None:
    graph, first = case
    bits = [FAIR] if fair else []
    both = readers(formula, assumed)
    found = accepting_lasso(graph, first, both, bits, sizes)
    reference = Reference(graph, both, bits)
    best = reference.shortest_lasso(reference.starts(first))
    assert (found is None) == (best is None) == (not reference.has_lasso(reference.starts(first)))
    product = Product(graph, both, bits, sizes)
    assert product.accepts(product.initial(first)) == (found is not None)
    if found is not None:
        assert found.loop is not None and follows(graph, found)
        stem, loop = word(found, first)
        assert loop and satisfies(assumed, stem, loop) and not satisfies(formula, stem, loop)
        assert not fair or any(x >> FAIR & 1 for x in loop)
        assert len(stem) - 1 + len(loop) == best


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=5), st.sampled_from(SIZES))
def test_bad_prefixes_are_bad_and_shortest(case: Case, formula: Formula, sizes: Sizes) -> None:
    graph, first = case
    keys, project = projection(formula)
    found = shortest_bad_prefix(graph, first, BadPrefix(formula, keys), project, sizes)
    length = bad_prefix_length(graph, first, BadPrefix(formula, keys), project)
    assert (found is None) == (length is None)
    if found is not None:
        assert follows(graph, found) and found.loop is None
        stem, _ = word(found, first)
        assert len(stem) - 1 == length
        alphabet = range(1 << len(KEYS))
        assert not any(satisfies(formula, stem, [a, b]) for a in alphabet for b in alphabet)
    elif safety(formula).holds:
        wrong = Reader(translate(formula, keys, negate=True), project)
        assert accepting_lasso(graph, first, [wrong], [], sizes) is None


@pytest.mark.slow
@settings(max_examples=examples(150), deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=4), formulas(KEYS, max_leaves=3), st.sampled_from(SIZES))
def test_a_bad_prefix_under_an_assumption_is_the_shortest_that_can_go_on(
    case: Case, formula: Formula, assumed: Formula, sizes: Sizes
) -> None:
    graph, first = case
    keys, project = projection(formula)
    always = [Reader(translate(assumed, KEYS), WHOLE)]
    monitor = BadPrefix(formula, keys)
    found = continued_bad_prefix(first, monitor, project, Product(graph, always, [], sizes))
    told = has_continued_bad_prefix(first, BadPrefix(formula, keys), project, Product(graph, always, [], sizes))
    assert told == (found is not None)
    best = Reference(graph, always, []).continued_bad_prefix(first, BadPrefix(formula, keys), project)
    assert (found is None) == (best is None)
    if found is not None:
        assert found.loop is not None and follows(graph, found)
        stem, loop = word(found, first)
        assert satisfies(assumed, stem, loop) and not satisfies(formula, stem, loop)
        state, bad = monitor.initial(), None
        for i, letter in enumerate([*stem, *loop]):
            state = None if state is None else monitor.step(state, project(letter))
            if state is None:
                bad = i
                break
        assert bad is not None and (bad == best or (monitor.initial() is None and best == 0))


# ---------------------------------------------------------------- many acceptance sets


def rounds(sets: int) -> Automaton:
    """All words, with edge k in acceptance set k: a loop has to take them all."""
    edges = tuple(Edge(0, 0, (i + 1) % sets, 1 << i) for i in range(sets))
    return Automaton((), tuple((edge,) for edge in edges), sets)


@pytest.mark.parametrize("sets", [1, 8, 9, 62, 63, 100])
def test_any_number_of_acceptance_sets(sets: int) -> None:
    graph = made([[(0, 1), (1, 0)], []])
    reader = Reader(rounds(sets), Projection([]))
    found = accepting_lasso(graph, [0], [reader], [])
    assert found is not None and follows(graph, found)
    assert (len(found.letters), found.loop) == (sets, 0)
    # A set that no edge is in cannot be shown.
    edges = reader.automaton.edges
    more = Reader(Automaton((), edges, sets + 1), Projection([]))
    for sizes in (SIZES[0], BLIND):
        assert accepting_lasso(graph, [0], [more], [], sizes) is None


def test_loops_that_show_the_sets_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is done when showing them in any order would take too many states."""
    graph = made([[(1, 1)], [(0, 2), (1, 4)]])
    lengths = []
    for most in (lassos.MOST_VISITS, 4):
        monkeypatch.setattr(lassos, "MOST_VISITS", most)
        found = accepting_lasso(graph, [0], [Reader(rounds(10), Projection([]))], [0, 1, 2])
        assert found is not None and found.loop is not None and follows(graph, found)
        _, loop = word(found, [0])
        assert set(loop) == {1, 2, 4}
        assert len(loop) % 10 == 0
        lengths.append(len(loop))
    assert lengths[0] <= lengths[1]


# ---------------------------------------------------------------- larger graphs


def ladder(rungs: int) -> Graph:
    """A long way with crossings: node 2i and 2i + 1 lead to 2i + 2 and 2i + 3; the way ends in a loop of three."""
    rows: list[list[tuple[int, int | None]]] = []
    for i in range(rungs):
        rows += [[(2 * i + 2, 0), (2 * i + 3, 1)]] * 2
    end = 2 * rungs
    return made([*rows, [(end + 2, 0)], [(end + 2, 2)], [(end + 3, 2)], [(end + 4, 2)], [(end + 2, 3)]])


@pytest.mark.parametrize("sizes", SIZES)
def test_every_array_grows(sizes: Sizes) -> None:
    rungs = 1500
    graph = ladder(rungs)
    never = apply("G", apply("F", atom("p")))
    answered = apply("G", apply("implies", atom("p"), apply("F", atom("q"))))
    for formula, length in ((never, None), (answered, None), (apply("F", apply("G", atom("p"))), rungs + 4)):
        keys, project = projection(formula)
        wrong = Reader(translate(formula, keys, negate=True), project)
        found = accepting_lasso(graph, [0], [wrong], [], sizes)
        assert (found and len(found.letters)) == length
    keys, project = projection(apply("G", apply("not", apply("and", atom("p"), atom("q")))))
    monitor = BadPrefix(apply("G", apply("not", apply("and", atom("p"), atom("q")))), keys)
    bad = shortest_bad_prefix(graph, [0], monitor, project, sizes)
    assert bad is not None and follows(graph, bad)
    assert len(bad.letters) == rungs + 4


def test_the_loop_is_not_the_component() -> None:
    """A large component: all letters show p but one, which lies on a short loop."""
    size = 2000
    rows: list[list[tuple[int, int | None]]] = [[((i + 1) % size, 1)] for i in range(size)]
    rows[1] += [(0, 0)]
    formula = apply("F", apply("G", atom("p")))
    keys, project = projection(formula)
    wrong = Reader(translate(formula, keys, negate=True), project)
    found = accepting_lasso(made(rows), [1], [wrong], [])
    assert found is not None and len(found.letters) == 2


def test_a_partial_graph_has_no_runs_through_what_is_not_expanded() -> None:
    graph = made([[(1, 1)]])
    graph.count = 2
    formula = apply("G", atom("p"))
    keys, project = projection(formula)
    assert accepting_lasso(graph, [1], [Reader(translate(formula, keys), project)], []) is None


def test_the_work_for_shorter_loops_is_limited_in_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ring of which one node has a loop of its own: each node before it is tried with the work that is left."""
    ring = [[(i % 9 + 1, 1)] for i in range(10)]
    ring[5].append((5, 1))
    allowed: list[int | None] = []
    shortest = lassos._Loops.shortest

    def recorded(loops: lassos._Loops, node: tuple[int, int], limit: int | None, most: int | None):
        allowed.append(most)
        return shortest(loops, node, limit, most)

    monkeypatch.setattr(lassos._Loops, "shortest", recorded)
    keys, project = projection(apply("G", atom("p")))
    reader = Reader(translate(apply("G", atom("p")), keys), project)
    found = accepting_lasso(made(ring), [1], [reader], [])
    assert found is not None and found.loop == 5 and len(found.letters) == 6
    first, *more = [most for most in allowed if most is not None]
    assert first == lassos.FIRST_SHARE * lassos.EXTRA_WORK
    assert len(more) == 4 and more == sorted(more, reverse=True) and more[-1] < more[0] < lassos.EXTRA_WORK


# ---------------------------------------------------------------- limits


class Opened:
    """Counts the regions of memory that are open."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.open: set[int] = set()
        begin, end = Region.__init__, Region.close

        def opened(region: Region, size: int) -> None:
            begin(region, size)
            self.open.add(id(region))

        def closed(region: Region) -> None:
            end(region)
            self.open.discard(id(region))

        monkeypatch.setattr(Region, "__init__", opened)
        monkeypatch.setattr(Region, "close", closed)


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [TINY, SPARSE])
def test_a_limit_ends_a_search_anywhere_and_gives_the_memory_back(
    monkeypatch: pytest.MonkeyPatch, sizes: Sizes
) -> None:
    graph = made([[(1, 1), (2, 2), (0, 3)], [(2, 3), (0, 0)], [(1, 0), (2, 4)]])
    formula, assumed = apply("F", apply("G", atom("p"))), apply("G", apply("F", atom("q")))
    keys, project = projection(formula)
    both = readers(formula, assumed)
    safe = apply("G", atom("p"))
    searches = (
        lambda: accepting_lasso(graph, [0], both, [FAIR], sizes),
        lambda: shortest_bad_prefix(graph, [1], BadPrefix(formula, keys), project, sizes),
        lambda: continued_bad_prefix([1], BadPrefix(safe, keys), project, Product(graph, both, [], sizes)),
    )
    opened = Opened(monkeypatch)
    for search in searches:
        limit = 0
        while True:
            left = limit

            def stop() -> None:
                nonlocal left
                left -= 1
                if left < 0:
                    raise LimitReached("enough")

            try:
                with ticking(stop):
                    search()
            except LimitReached:
                limit += 1
            else:
                break
            finally:
                assert not opened.open
        assert limit > 3


def test_letters_show_their_atoms() -> None:
    assert names(5) == {"p"}
