"""Simplified formulas mean the same; implications that are seen are right."""

import random
from itertools import combinations, product

import pytest
from hypothesis import given, settings

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, conjunction, negation, postorder, size
from llfsm_verify.logic.hierarchy import form
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.implication import Implication, Purity
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import Simplifier, simplified
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


@pytest.mark.slow
@given(formulas(max_leaves=10), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_the_meaning_stays(f, word):
    simple = simplified(f)
    assert evaluate(simple, *word) == evaluate(f, *word)
    assert evaluate(simplified(f, negate=True), *word) != evaluate(f, *word)
    assert all(node.op != "not" or node.args[0].op == "atom" for node in postorder(simple))


@pytest.mark.slow
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


@pytest.mark.slow
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
        ("a U (b && G F c)", "G F c && a U b"),
        ("a W (b && G F c)", "a W (b && G F c)"),
        ("a W (b || G F c)", "G F c || a W b"),
        ("a R (b || F G c)", "F G c || a R b"),
        ("a M (b || F G c)", "a M (b || F G c)"),
    ],
)
def test_rules(text, expected):
    assert str(simplified(parsed(text))) == expected


def over(inner, others, binary=("and", "or", "U", "R", "W", "M")):
    unary = [apply(o, x) for o in ("X", "F", "G") for x in inner] if len(binary) > 1 else []
    return unary + [apply(o, x, y) for o in binary for x in inner for y in others]


def drawn(shape):
    """Formulas in which the same parts come again, so that rules apply."""
    leaves = [atom("a"), atom("b")]
    one = leaves + over(leaves, leaves)
    if shape in ("and", "or", "U", "R", "W", "M"):  # all with such an operator around at most one each
        return over(one, one, (shape,))
    chance = random.Random(1)
    if shape == "next":
        nexts = [apply("X", x) for x in one]
        inside = over(leaves, over(leaves, nexts, ("and", "or")), ("and", "or"))
        return chance.sample(over(one, nexts, ("and", "or")), 500) + inside
    if shape == "again":
        inner = chance.sample(over(one, one), 250) + over(leaves, [apply("X", x) for x in one])
        return [apply(x, apply(y, f)) for f in inner for x, y in ("GF", "FG")]
    more = [*leaves, negation(atom("a")), atom("c")]
    two = over(chance.sample(over(more, more), 30) + one, chance.sample(over(more, more), 30) + one)
    if shape == "two":
        return chance.sample(two, 1_000)
    return [apply(chance.choice(("and", "or", "U", "R", "W", "M")), *chance.sample(two, 2)) for _ in range(300)]


LETTERS = [("", "", "a"), ("a", "b", ""), ("ab", "a", "b"), ("b", "", "ab"), ("c", "ac", "b"), ("a", "a", "bc")]
WORDS = [
    (stem, loop)
    for x, y, z in ([frozenset(letter) for letter in three] for three in LETTERS)
    for stem, loop in (([x], [y, z]), ([x, y], [z]))
]
SIZES = {
    "and": 2962,
    "or": 2962,
    "U": 3342,
    "R": 3336,
    "W": 3348,
    "M": 3354,
    "next": 4238,
    "again": 7029,
    "two": 4001,
    "three": 1955,
}


@pytest.mark.slow
@pytest.mark.parametrize("shape", SIZES)
def test_formulas_become_as_short_as_they_have_been_and_mean_the_same(shape):
    """Of what a missing rule would show. A new rule may make them shorter, and the number smaller."""
    total = 0
    for f in drawn(shape):
        simple = simplified(f)
        total += size(simple)
        for word in WORDS[:: 5 if size(f) < 8 else 3]:
            assert evaluate(simple, *word) == evaluate(f, *word), f
    assert total <= SIZES[shape]


def test_simplifying_twice_changes_nothing():
    for text in ("G (p -> (p U q)) && F r", "(p W q) R (X r U G p)", "G F (p && X q) -> F G r"):
        once = simplified(parsed(text))
        assert Simplifier().simplify(once) is once


@pytest.mark.slow
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


def test_what_can_be_taken_out_of_an_operator():
    """Parts that hold at all moments or at none, in each binary operator, which random words seldom tell apart."""
    letters = [frozenset(x) for n in range(4) for x in combinations("abc", n)]
    words = [word for word in product(letters, repeat=2) if word[0] != word[1]]
    parts = ("G F c", "F G c", "F c", "G c", "X c", "c")
    for operator, join, part in product("UWRM", ("&&", "||"), parts):
        for text in (f"a {operator} (b {join} {part})", f"(b {join} {part}) {operator} a"):
            f = parsed(text)
            simple = simplified(f)
            if simple == nnf(f):
                continue
            for first, second in words:
                for word in (([first], [second]), ([], [first, second])):
                    assert evaluate(simple, *word) == evaluate(f, *word), (text, str(simple), word)
