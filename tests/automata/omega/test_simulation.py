"""The greatest simulation, found by comparing few pairs, is the one that the definition gives."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.labels import TruthTables
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega import simulation
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.automata.omega.symbolic import Symbolic, merged_row
from llfsm_verify.logic.formula import apply, atom
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.testing.formulas import ATOMS, formulas, lassos
from tests.quick import examples

LETTERS = range(4)


@st.composite
def graphs(draw):
    n = draw(st.integers(1, 6))
    arc = st.tuples(st.integers(1, 15), st.integers(0, 3), st.integers(0, n - 1))
    rows = [merged_row(draw(st.lists(arc, max_size=4))) for _ in range(n)]
    return Symbolic(TruthTables(2), tuple(rows), 2)


def by_definition(graph):
    """All pairs (q, p) in which p can follow q, each letter on its own, until no pair is lost."""
    n = len(graph.rows)
    moves = [[(x, a, t) for label, a, t in row for x in LETTERS if label >> x & 1] for row in graph.rows]
    pairs = {(q, p) for q in range(n) for p in range(n)}
    while True:
        left = {
            (q, p)
            for q, p in pairs
            if all(any(y == x and a & ~b == 0 and (t, u) in pairs for y, b, u in moves[p]) for x, a, t in moves[q])
        }
        if left == pairs:
            return pairs
        pairs = left


@pytest.mark.slow
@given(graphs())
@settings(max_examples=examples(400), deadline=None)
def test_the_simulation_is_the_greatest(graph):
    above = simulation.simulating(graph)
    n = len(graph.rows)
    assert {(q, p) for q in range(n) for p in range(n) if above[q] >> p & 1} == by_definition(graph)


@given(formulas(max_leaves=6), lassos(), st.integers(0, 12))
@settings(max_examples=examples(100), deadline=None)
def test_giving_up_merges_nothing_and_loses_nothing(f, word, limit):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulation, "MAX_COMPARISONS", limit)
        assert accepts(translate(f, ATOMS), *word) == evaluate(f, *word)


def test_giving_up_leaves_every_state_to_itself(monkeypatch):
    graph = Symbolic(TruthTables(1), (((3, 0, 1),), ((3, 0, 0),)), 0)
    assert simulation.simulating(graph) == [3, 3]
    monkeypatch.setattr(simulation, "MAX_COMPARISONS", 0)
    assert simulation.simulating(graph) == [1, 2]
    assert simulation.direct_simulation(graph).rows == graph.rows
    assert simulation.reverse_simulation(graph).rows == graph.rows


def test_long_chains_compare_few_pairs(monkeypatch):
    calls = []
    follows = simulation._follows
    monkeypatch.setattr(simulation, "_follows", lambda *a: calls.append(a) or follows(*a))
    late = atom("p")
    for _ in range(150):
        late = apply("X", late)
    assert len(translate(late).edges) == 152
    # Each of the few reductions looks at each state a few times, not at each pair of states.
    assert 0 < len(calls) < 150 * 20
