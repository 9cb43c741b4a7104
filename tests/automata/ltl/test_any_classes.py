"""Classes and Büchi automata of formulas with the past and regular expressions: dual, and as those of equal meaning."""

import pytest
from hypothesis import given, settings

from llfsm_verify.automata.ltl.answers import buchi_of, classify_any
from llfsm_verify.automata.ltl.classes import classify
from llfsm_verify.automata.ltl.translation import Untranslatable
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import apply, atom, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.simplify import simplify_any
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.testing.formulas import formulas, lassos
from tests.automata.ltl.test_psl import KEYS, bound, past
from tests.quick import examples

DUAL = dict(zip("BSGORPT", "BGSOPRT", strict=True))
P, Q = map(atom, KEYS)


def read(text, syntax="llfsm"):
    return parse_in(syntax, Fragment.whole(Source("test", text))).formula


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("G (p -> O q)", "!p W q"),
        ("F (p && O q)", "F (q && F p)"),
        ("G F (p S q)", "G F q || F G p"),
        ("F G (q -> Y p)", "F G (p || X !q)"),
        ("G (p -> Y q) && G F p", "G (X p -> q) && G F p && !p"),
        ("H p", "p"),
        ("G H p || F O q", "G p || F q"),
        ("(G F O p -> G F q) && F[0:2] p", "(F p -> G F q) && (p || X p || X X p)"),
    ],
)
def test_the_past_has_the_class_of_its_meaning(text, plain):
    if text != "G F (p S q)":  # there q must have held: the plain formula only has the same class as a likeness
        assert classify_any(read(text)) == classify(read(plain))
    assert classify_any(read(text)) is not None


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ("{a;b}!", "B"), ("{a[*];b}!", "G"), ("{a[*];b}", "S"), ("{a[*];b}[]->c", "S"), ("{a[*];b}<>->c", "G"),
        ("{a[*];b}[]->Fc", "R"), ("G({a}[]->{b[*];c}!)", "R"), ("F({a}<>->Gb)", "P"), ("{(1;1)[*];a}[]->b", "S"),
    ],
)  # fmt: skip
def test_expressions(text, letter):
    assert classify_any(read(text, "spot")) == letter


@given(past())
@settings(max_examples=examples(60), deadline=None)
def test_negation_is_dual(f):
    assert classify_any(negation(f)) == DUAL[classify_any(f)]


@given(bound())
@settings(max_examples=examples(60), deadline=None)
def test_negation_is_dual_for_expressions(f):
    assert classify_any(negation(f)) == DUAL[classify_any(f)]


@given(formulas(KEYS, 4))
@settings(max_examples=examples(60), deadline=None)
def test_a_past_that_says_nothing_changes_no_class(f):
    assert classify_any(apply("and", f, apply("or", P, negation(apply("H", P))))) is not None
    assert classify_any(apply("or", apply("Y", apply("and", P, negation(P))), f)) == classify(f)


@given(past(), lassos(KEYS))
@settings(max_examples=examples(100), deadline=None)
def test_buchi_automata_of_the_past(f, word):
    check_buchi(f, word)


@given(bound(), lassos(KEYS))
@settings(max_examples=examples(100), deadline=None)
def test_buchi_automata_of_expressions(f, word):
    check_buchi(f, word)


def check_buchi(f, word):
    automaton = buchi_of(f)
    letters = [[frozenset(letter & set(automaton.atoms)) for letter in part] for part in word]
    assert accepts(automaton, *letters) == evaluate(f, *word)
    assert automaton.acceptance_sets <= 1
    assert all(len({edge.acceptance for edge in row}) <= 1 for row in automaton.edges)


@given(past(6), lassos(KEYS))
@settings(max_examples=examples(150), deadline=None)
def test_simplified_formulas_of_the_past_mean_the_same(f, word):
    assert evaluate(simplify_any(f), *word) == evaluate(f, *word)


@given(bound(), lassos(KEYS))
@settings(max_examples=examples(150), deadline=None)
def test_simplified_expressions_mean_the_same(f, word):
    assert evaluate(simplify_any(f), *word) == evaluate(f, *word)


def test_time_is_refused():
    with pytest.raises(Untranslatable, match="time"):
        classify_any(read("F[<=5ms] p"))
    with pytest.raises(Untranslatable):
        buchi_of(read("F[<=5ms] p"))
