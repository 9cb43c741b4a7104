"""Automata accept exactly the words that satisfy their formula."""

import pytest
from hypothesis import given, settings

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.products import accepts, disjoint
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.limits import ticking
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, conjunction, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.testing.formulas import ATOMS, formulas, lassos
from tests.quick import examples

P, Q = atom("p"), atom("q")


@pytest.mark.slow
@given(formulas(max_leaves=6), lassos())
@settings(max_examples=examples(500), deadline=None)
def test_a_word_is_accepted_when_it_satisfies_the_formula(f, word):
    expected = evaluate(f, *word)
    assert accepts(translate(f, ATOMS), *word) == expected
    assert accepts(translate(f, ATOMS, negate=True), *word) != expected


@pytest.mark.slow
@given(formulas(max_leaves=5))
@settings(max_examples=examples(200), deadline=None)
def test_no_word_satisfies_a_formula_and_its_negation(f):
    assert disjoint(translate(f, ATOMS), translate(f, ATOMS, negate=True))


@pytest.mark.slow
@given(formulas(max_leaves=6))
@settings(max_examples=examples(200), deadline=None)
def test_every_state_has_a_word(f):
    a = translate(f, ATOMS)
    for state in range(len(a.edges)):
        found = find_accepting_lasso(
            [state], lambda q: ((e, e.acceptance, e.target) for e in a.edges[q]), a.acceptance_sets
        )
        assert found is not None
    assert all(e.positive & e.negative == 0 for row in a.edges for e in row)


@given(formulas(max_leaves=6))
@settings(max_examples=examples(100), deadline=None)
def test_an_empty_automaton_is_that_of_an_unsatisfiable_formula(f):
    a = translate(f, ATOMS)
    if a.is_empty:
        assert disjoint(translate(TRUE, ATOMS), a)
    else:
        found = find_accepting_lasso(
            [0], lambda q: ((e, e.acceptance, e.target) for e in a.edges[q]), a.acceptance_sets
        )
        word = [[key for i, key in enumerate(ATOMS) if e.positive >> i & 1] for e, _ in (*found.stem, *found.loop)]
        letters = [frozenset(letter) for letter in word]
        assert evaluate(f, letters[: len(found.stem)], letters[len(found.stem) :])


@pytest.mark.parametrize(
    ("f", "states", "sets"),
    [
        (TRUE, 1, 0),
        (FALSE, 0, 0),
        (apply("G", P), 1, 0),
        (apply("F", P), 2, 1),
        (apply("G", apply("F", P)), 1, 1),
        (apply("F", apply("G", P)), 2, 1),
        (apply("U", P, Q), 2, 1),
        (apply("R", P, Q), 2, 0),
        (apply("G", apply("implies", P, apply("F", Q))), 2, 1),
        (conjunction(apply("G", apply("F", atom(k))) for k in "abcdef"), 1, 6),
        # Where one fulfilment is still being checked, no other is begun.
        (apply("G", apply("F", conjunction([P, apply("X", apply("X", Q))]))), 3, 1),
    ],
)
def test_small_formulas_have_small_automata(f, states, sets):
    a = translate(f)
    assert (len(a.edges), a.acceptance_sets) == (states, sets)


@pytest.mark.slow
def test_limits_are_kept():
    chain = P
    for _ in range(100):
        chain = apply("X", chain)
    assert len(translate(chain).edges) == 102
    with pytest.raises(AutomatonTooLarge, match="50 states"):
        translate(chain, max_states=50)
    many = conjunction(apply("F", atom(f"p{i}")) for i in range(12))
    with pytest.raises(AutomatonTooLarge):
        translate(many, max_transitions=1_000)


@pytest.mark.parametrize("text", ["G p", "F p", "p U q", "G F p", "X p", "G (p -> X q)"])
def test_a_limit_may_be_reached_and_not_passed(text):
    formula = parse_formula(Fragment.whole(Source("t", text))).formula
    whole = translate(formula)
    sizes = {"states": len(whole.edges), "transitions": whole.transitions}
    assert translate(formula, max_states=sizes["states"], max_transitions=sizes["transitions"]) == whole
    for what, size in sizes.items():
        if (what, size) == ("states", 1):
            continue  # without any state there would be nothing to say
        with pytest.raises(AutomatonTooLarge, match=f"more than {size - 1} ({what}|alternatives)"):
            translate(formula, **{f"max_{what}": size - 1})


def test_missing_atoms_are_refused_and_the_order_is_kept():
    with pytest.raises(ValueError, match="q"):
        translate(apply("U", P, Q), ["p"])
    a = translate(negation(P), ["q", "p"])
    assert a.edges[0][0].negative == 0b10


def test_the_tick_can_stop_the_construction():
    class Stop(Exception):
        pass

    def tick():
        raise Stop

    with pytest.raises(Stop), ticking(tick):
        translate(apply("U", P, Q))
