"""Automata put together from parts accept what those made at once accept, and stay small where those would not."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import TruthTables
from llfsm_verify.automata.ltl import translate as module
from llfsm_verify.automata.ltl.translate import Translator, intersection, translate, union
from llfsm_verify.automata.omega.products import accepts, disjoint
from llfsm_verify.automata.omega.symbolic import Symbolic, to_automaton
from llfsm_verify.logic.formula import apply, atom, conjunction, disjunction, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.simplify import Simplifier, simplified
from llfsm_verify.testing.formulas import ATOMS, formulas, lassos
from tests.automata.ltl.tableau import tableau
from tests.automata.ltl.test_tableau import KEYS, small
from tests.quick import examples

PARTS = st.lists(formulas(max_leaves=4), min_size=1, max_size=3)


def graph(f):
    return Translator(TruthTables(len(ATOMS)), ATOMS, Simplifier()).graph(simplified(f))


def accepted(found, word):
    return accepts(to_automaton(found, ATOMS, range(len(ATOMS))), *word)


@pytest.mark.slow
@given(PARTS, lassos())
@settings(max_examples=examples(100), deadline=None)
def test_union_is_disjunction_and_intersection_conjunction(parts, word):
    graphs = [graph(f) for f in parts]
    assert accepted(union(graphs), word) == any(evaluate(f, *word) for f in parts)
    total = graphs[0]
    for other in graphs[1:]:
        total = intersection(total, other, 1_000, 10_000)
    assert accepted(total, word) == all(evaluate(f, *word) for f in parts)


@pytest.mark.slow
@given(st.lists(formulas(KEYS, max_leaves=4), min_size=2, max_size=3), st.sampled_from([conjunction, disjunction]))
@settings(max_examples=examples(40), deadline=None)
def test_composed_formulas_agree_with_the_reference(parts, join):
    for f in (join(parts), apply("G", conjunction(parts)), apply("F", disjunction(parts))):
        assume(small(f, 4))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(module, "FEW_STATES", 0)
            patch.setattr(module, "MANY_TRANSITIONS", 1)
            for generalised in (True, False):
                found = translate(f, KEYS, generalised=generalised)
                assert disjoint(found, tableau(negation(f), KEYS))
                opposite = translate(f, KEYS, negate=True, generalised=generalised)
                assert disjoint(opposite, tableau(f, KEYS))
                assert disjoint(found, opposite)


def recurring(key):
    return apply("G", apply("F", atom(key)))


@pytest.mark.slow
def test_many_fairness_conditions():
    """Each is a choice between two branches; at once, all ways to fulfil some of them would be compared."""
    fair = [apply("implies", recurring(f"p{i}"), recurring(f"q{i}")) for i in range(20)]
    assert len(translate(conjunction(fair[:6])).edges) == 65
    assert len(translate(conjunction(fair), negate=True).edges) == 21


def test_empty_parts_and_limits():
    alphabet = TruthTables(1)
    empty = Symbolic(alphabet, (), 2)
    loop = Symbolic(alphabet, (((alphabet.true, 0, 0),),), 0)
    assert union([empty, empty]).rows == ()
    assert intersection(loop, empty, 1, 1).rows == ()
    assert intersection(loop, loop, 1, 1).rows == loop.rows
    assert accepted(union([empty, loop]), ([], [frozenset()]))
    with pytest.raises(AutomatonTooLarge):
        intersection(loop, loop, 1, 0)
    chain = Symbolic(alphabet, (((alphabet.true, 0, 1),), ((alphabet.true, 0, 1),)), 0)
    with pytest.raises(AutomatonTooLarge):
        intersection(chain, loop, 1, 9)
