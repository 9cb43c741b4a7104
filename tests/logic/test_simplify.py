"""Simplified formulas mean the same; implications that are seen are right."""

import pytest
from hypothesis import given, settings

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, conjunction, negation, postorder, size
from llfsm_verify.logic.hierarchy import form
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.purity import Purity
from llfsm_verify.logic.rewriting.simplify import Simplifier, simplified
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


@given(formulas(max_leaves=10), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_the_meaning_stays(f, word):
    simple = simplified(f)
    assert evaluate(simple, *word) == evaluate(f, *word)
    assert evaluate(simplified(f, negate=True), *word) != evaluate(f, *word)
    assert all(node.op != "not" or node.args[0].op == "atom" for node in postorder(simple))


@given(formulas(max_leaves=6), formulas(max_leaves=6), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_implications_are_right(f, g, word):
    f, g = nnf(f), nnf(g)
    implies = Implication()
    first, second = evaluate(f, *word), evaluate(g, *word)
    if implies(f, g):
        assert not first or second
    if implies.excludes(f, g):
        assert not (first and second)
    if implies.exhausts(f, g):
        assert first or second


@given(formulas(max_leaves=6), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_purity_is_right(f, word):
    f = nnf(f)
    purity = Purity()
    stem, loop = word
    shifted = (stem[1:], loop) if stem else ([], [*loop[1:], loop[0]])
    now, later = evaluate(f, stem, loop), evaluate(f, *shifted)
    if purity.is_eventual(f):
        assert now or not later
    if purity.is_universal(f):
        assert later or not now


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("F (a U b)", "F b"),
        ("G (a R b)", "G b"),
        ("(a U b) && (c U b)", "(a && c) U b"),
        ("G F (a || X b)", "G F (a || b)"),
        ("(a U b) || G a", "a W b"),
        ("(a W b) && F b", "a U b"),
        ("b || (a && X (a U b))", "a U b"),
        ("F p -> F p", "true"),
        ("(a && !b) U b", "a U b"),
        ("a U (a && b)", "b M a"),
        ("a W (a && b)", "b R a"),
        ("G (a U b)", "G (a || b) && G F b"),
        ("F G a && F G b", "F G (a && b)"),
        ("G F a || G F b", "G F (a || b)"),
        ("X a && X b", "X (a && b)"),
        ("X G F a", "G F a"),
        ("a U a", "a"),
        ("!a U a", "F a"),
        ("a && (b || !a)", "a && b"),
        ("G a && F (a && b)", "G a && F b"),
        ("G a && F (!a && b)", "false"),
        ("G a && b U (c && a)", "G a && b U c"),
        ("F a || G (a || b)", "F a || G b"),
        ("F a || b U (a && c)", "F a"),
        ("G !a || F (a && F b)", "!a W (a && F b)"),
        ("F a && G (!a || G b)", "a M (!a || G b)"),
        ("G (a W b)", "G (a || b)"),
        ("F (a W b)", "F (b || F G a)"),
        ("F (a R b)", "F (a && b || F G b)"),
        ("G (a M b)", "G b && G F a"),
        ("F (a M b)", "F (a && b)"),
        ("G (a && F G b)", "F G b && G a"),
        ("F (a && F G b)", "F G b && F a"),
        ("G (a || F G b)", "F G b || G a"),
        ("F (a || F G b)", "F (a || F G b)"),
        ("G (F b && G a)", "G F b && G a"),
        ("F (F b && G a)", "F (F b && G a)"),
        ("F (G F a && b)", "G F a && F b"),
        ("G (G F a || b)", "G F a || G b"),
        ("X (a && F G b)", "X (a && F G b)"),
    ],
)
def test_rules(text, expected):
    assert str(simplified(parsed(text))) == expected


def test_simplifying_twice_changes_nothing():
    for text in ("G (p -> (p U q)) && F r", "(p W q) R (X r U G p)", "G F (p && X q) -> F G r"):
        once = simplified(parsed(text))
        assert Simplifier().simplify(once) is once


def test_depth_and_length_are_no_crash():
    p, q = atom("p"), atom("q")
    deep = p
    for _ in range(2_000):
        deep = apply("X", deep)
    assert size(simplified(apply("U", apply("F", deep), apply("X", deep)))) < 3_000
    assert simplified(conjunction((deep, negation(deep)))) is FALSE
    tower = p
    for i in range(500):
        tower = apply("U" if i % 2 else "R", tower, q if i % 3 else p)
    assert simplified(tower) is not TRUE
    wide = conjunction(apply("F", atom(f"p{i}")) for i in range(300))
    assert len(simplified(wide).args) == 300


def test_forms():
    shown = form(nnf(parsed("G (p -> F q)")))
    assert (shown.safety, shown.guarantee, shown.recurrence, shown.persistence) == (False, False, True, False)
    assert form(nnf(parsed("F G p"))).persistence
    assert form(nnf(parsed("G p || F q"))).obligation
    assert form(nnf(parsed("p W (q && X r)"))).safety
