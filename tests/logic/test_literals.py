"""A formula over literals means what the formula means, and more literals never make it false."""

import pytest
from hypothesis import given, settings

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import atoms, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.literals import every_literal, literal_letter, over_literals
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

WORDS = [([], [frozenset(), frozenset("a")]), ([frozenset("b")], [frozenset("ab")]), ([frozenset("a")], [frozenset()])]


def check(f, stem, loop):
    keys = frozenset(atoms(f))
    stem, loop = ([letter & keys for letter in part] for part in (stem, loop))
    literals = [[literal_letter(keys, letter) for letter in part] for part in (stem, loop)]
    for whole in (f, negation(f)):
        places = over_literals(whole)
        assert places is not None
        over = places[whole, False]
        assert evaluate(over, *literals) == evaluate(whole, stem, loop)
        if evaluate(whole, stem, loop):
            more = every_literal(whole)
            assert evaluate(over, [more] * len(stem), [more] * len(loop))


@pytest.mark.parametrize("text", ["a -> b", "a xor b", "a <-> b", "(a -> X b) -> b", "!(a <-> F b)", "G (a xor X b)"])
@pytest.mark.parametrize("word", WORDS)
def test_operators_that_are_not_monotone(text, word):
    check(parse_formula(Fragment.whole(Source("test", text))).formula, *word)


@pytest.mark.slow
@given(formulas(max_leaves=8), lassos())
@settings(max_examples=examples(200), deadline=None)
def test_random_formulas(f, word):
    if over_literals(f) is not None:
        check(f, *word)
