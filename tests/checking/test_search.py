"""The product search against brute force: every short lasso of a random small graph, evaluated by itself."""

from __future__ import annotations

from collections.abc import Iterator

from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.safety import BadPrefix, safety
from llfsm_verify.automata.translate import translate
from llfsm_verify.checking.search import (
    Product,
    Projection,
    Reader,
    Walk,
    accepting_lasso,
    continued_bad_prefix,
    shortest_bad_prefix,
)
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.testing.formulas import formulas

KEYS = ("p", "q")
FAIR = len(KEYS)
"""The bit behind the atoms' bits is a fairness condition."""
LONGEST = 6

Edges = list[list[tuple[int, int]]]


@st.composite
def graphs(draw: st.DrawFn) -> tuple[Graph, list[int]]:
    """A graph of up to three nodes whose edges carry letters of two atoms and a fairness bit, and the first letters."""
    size = draw(st.integers(1, 3))
    node, letter = st.integers(0, size - 1), st.integers(0, (1 << (FAIR + 1)) - 1)
    edges = [draw(st.lists(st.tuples(node, letter), min_size=1, max_size=3, unique=True)) for _ in range(size)]
    return made(edges, 1), [draw(st.integers(0, 3))]


def made(edges: Edges, roots: int) -> Graph:
    alphabet = sorted({letter for row in edges for _, letter in row})
    return Graph.of_edges([[(t, alphabet.index(x)) for t, x in row] for row in edges], alphabet, roots)


def shown(letter: int) -> frozenset[str]:
    return frozenset(k for i, k in enumerate(KEYS) if letter >> i & 1)


def lassos(graph: Graph, first: list[int], longest: int) -> Iterator[tuple[list[int], int]]:
    """All lassos with at most `longest` steps: the letters with the first one, and the index where the loop starts."""
    paths = [([root], [first[root]]) for root in range(graph.roots)]
    while paths:
        nodes, letters = paths.pop()
        for i, node in enumerate(nodes[:-1]):
            if node == nodes[-1]:
                yield letters, i + 1
        if len(nodes) <= longest:
            paths += [([*nodes, t], [*letters, x]) for t, x in graph.edges(nodes[-1])]


def violates(formula: Formula, letters: list[int], loop: int) -> bool:
    word = [shown(x) for x in letters]
    return not evaluate(formula, word[:loop], word[loop:])


def of(walk: Walk, first: list[int]) -> list[int]:
    return [first[walk.nodes[0]], *walk.letters]


def follows(graph: Graph, walk: Walk) -> bool:
    return all((t, x) in set(graph.edges(n)) for n, t, x in zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False))


def project(formula: Formula) -> tuple[tuple[str, ...], Projection]:
    names = tuple(sorted(atoms(formula)))
    return names, Projection([KEYS.index(n) for n in names])


@settings(max_examples=300, deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=5), formulas(KEYS, max_leaves=3), st.booleans())
def test_lassos_are_found_exactly_where_there_are_some(
    graph_first: tuple[Graph, list[int]], formula: Formula, assumed: Formula, fair: bool
) -> None:
    graph, first = graph_first
    names, projection = project(formula)
    bits = [FAIR] if fair else []
    always = Reader(translate(assumed, KEYS), Projection(range(len(KEYS))))
    wrong = Reader(translate(formula, names, negate=True), projection)
    found = accepting_lasso(graph, first, [always, wrong], bits, lambda: None)
    if found is not None:
        assert found.loop is not None
        assert follows(graph, found)
        assert found.nodes[-1] == found.nodes[found.loop]
        letters = of(found, first)
        assert violates(formula, letters, found.loop + 1)
        assert not violates(assumed, letters, found.loop + 1)
        assert not fair or any(x >> FAIR & 1 for x in letters[found.loop + 1 :])
        return
    for letters, loop in lassos(graph, first, LONGEST):
        if not fair or any(x >> FAIR & 1 for x in letters[loop:]):
            assert violates(assumed, letters, loop) or not violates(formula, letters, loop), (letters, loop)


@settings(max_examples=300, deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=5))
def test_bad_prefixes_are_bad_shortest_and_all_there_is_of_safety(
    graph_first: tuple[Graph, list[int]], formula: Formula
) -> None:
    graph, first = graph_first
    names, projection = project(formula)
    found = shortest_bad_prefix(graph, first, BadPrefix(formula, names), projection, lambda: None)
    alphabet = [frozenset(), frozenset("p"), frozenset("q"), frozenset("pq")]
    if found is not None:
        assert follows(graph, found)
        prefix = [shown(x) for x in of(found, first)]
        assert not any(evaluate(formula, prefix, [a, b]) for a in alphabet for b in alphabet)
        for letters, loop in lassos(graph, first, len(found.letters)):
            word = [shown(x) for x in letters]
            shorter = [w for w in (word[:loop], word) if len(w) < len(prefix)]
            for w in shorter:
                assert not evaluate_all_bad(formula, w, names)
    elif safety(formula).holds:
        for letters, loop in lassos(graph, first, LONGEST):
            assert not violates(formula, letters, loop)


@settings(max_examples=300, deadline=None)
@given(graphs(), formulas(KEYS, max_leaves=4), formulas(KEYS, max_leaves=3))
def test_a_bad_prefix_under_an_assumption_is_the_shortest_that_can_go_on(
    graph_first: tuple[Graph, list[int]], formula: Formula, assumed: Formula
) -> None:
    graph, first = graph_first
    names, projection = project(formula)
    monitor = BadPrefix(formula, names)
    always = Reader(translate(assumed, KEYS), Projection(range(len(KEYS))))
    runs = Product(graph, [always], [], lambda: None)
    found = continued_bad_prefix(first, monitor, projection, runs, lambda: None)

    def bad_at(letters: list[int]) -> int | None:
        state = monitor.initial()
        for i, letter in enumerate(letters):
            state = None if state is None else monitor.step(state, projection(letter))
            if state is None:
                return i
        return None

    best = None
    if found is not None:
        assert found.loop is not None
        assert follows(graph, found)
        assert found.nodes[-1] == found.nodes[found.loop]
        letters = of(found, first)
        assert not violates(assumed, letters, found.loop + 1)
        assert violates(formula, letters, found.loop + 1)
        best = bad_at(letters)
        assert best is not None
    for letters, loop in lassos(graph, first, LONGEST):
        if not violates(assumed, letters, loop):
            bad = bad_at(letters)
            assert bad is None or (best is not None and best <= bad)


def evaluate_all_bad(formula: Formula, word: list[frozenset[str]], names: tuple[str, ...]) -> bool:
    """No word continues this one to satisfy the formula, by the automaton of the formula without its prefix monitor."""
    automaton = translate(formula, names)
    states = {0} if automaton.edges else set()
    for letter in word:
        mask = automaton.letter(letter)
        states = {e.target for s in states for e in automaton.edges[s] if e.allows(mask)}
    return not states


def test_a_partial_graph_has_no_runs_through_what_is_not_expanded() -> None:
    graph = made([[(1, 1)]], 1)
    graph.count = 2
    from llfsm_verify.logic.formula import apply, atom

    formula = apply("G", atom("p"))
    names, projection = project(formula)
    reader = Reader(translate(formula, names), projection)
    assert accepting_lasso(graph, [1], [reader], [], lambda: None) is None
