"""Automata of formulas with the past, step bounds and regular expressions against evaluation on lassos."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.ltl.translation import Untranslatable, automaton_of
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.formula import apply, atom, atoms, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.testing.formulas import formulas, lassos
from tests.automata.finite.test_regular import expressions
from tests.quick import examples

KEYS = ("p", "q")
P, Q = map(atom, KEYS)


def agree(f, word):
    stem, loop = word
    expected = evaluate(f, stem, loop)
    assert accepts(automaton_of(f, KEYS), stem, loop) == expected
    assert accepts(automaton_of(f, KEYS, negate=True), stem, loop) != expected


def past(max_leaves=4):
    def larger(inner):
        unary = st.builds(apply, st.sampled_from(["Y", "Z", "O", "H", "X", "F", "G"]), inner)
        binary = st.builds(apply, st.sampled_from(["S", "T", "U", "and", "or", "iff"]), inner, inner)
        return st.one_of(unary, binary, inner.map(negation))

    return st.recursive(st.sampled_from([P, Q]), larger, max_leaves=max_leaves)


@pytest.mark.slow
@given(past(), lassos(KEYS))
@settings(max_examples=examples(150), deadline=None)
def test_past(f, word):
    agree(f, word)


@given(formulas(KEYS, 3), st.sampled_from([("X[]", "3"), ("F[]", "0:2"), ("G[]", "1:3")]), lassos(KEYS))
@settings(max_examples=examples(80), deadline=None)
def test_steps(f, op, word):
    agree(apply(op[0], f, bound=op[1]), word)


def bound(max_leaves=3):
    inner = formulas(KEYS, 2)
    e = expressions(max_leaves=max_leaves)
    return st.one_of(
        st.builds(apply, st.sampled_from(["[]->", "<>->"]), e, inner), e.map(lambda r: apply("closure", r))
    )


@pytest.mark.slow
@given(bound(), st.sampled_from(["", "G", "F", "not"]), lassos(KEYS))
@settings(max_examples=examples(250), deadline=None)
def test_expressions(f, around, word):
    agree(f if not around else negation(f) if around == "not" else apply(around, f), word)


@pytest.mark.slow
@given(bound(2), bound(2), st.sampled_from(["and", "or", "U", "R", "iff"]), lassos(KEYS))
@settings(max_examples=examples(60), deadline=None)
def test_two_expressions(f, g, op, word):
    agree(apply(op, f, g), word)


@pytest.mark.slow
@given(expressions(max_leaves=2), bound(2), st.sampled_from(["[]->", "<>->"]), lassos(KEYS))
@settings(max_examples=examples(80), deadline=None)
def test_nested_expressions(r, f, op, word):
    agree(apply(op, r, f), word)


@pytest.mark.parametrize("op", ["[]->", "<>->"])
@pytest.mark.parametrize("joined", ["and", "or"])
@pytest.mark.parametrize("inner", ["[]->", "<>->"])
def test_an_expression_beside_an_atom_inside_another_one(op, joined, inner):
    """Every word with up to two letters before a loop of one."""
    f = apply(op, apply("seq", P, Q), apply(joined, Q, apply(inner, apply("seq", Q, P), P)))
    every = [frozenset(), frozenset("p"), frozenset("q"), frozenset("pq")]
    automaton = automaton_of(f, KEYS)
    for size in range(4):
        for stem in product(every, repeat=size):
            for last in every:
                assert accepts(automaton, list(stem), [last]) == evaluate(f, stem, [last])


def test_past_inside_expressions():
    r = apply("seq", P, repeat(Q, 1, None))
    f = apply("G", apply("[]->", r, apply("O", apply("and", P, apply("Y", Q)))))
    for word in ([{"p"}, {"q"}], [set()]), ([{"q"}, {"p"}, {"q"}], [{"q"}]):
        agree(f, ([frozenset(x) for x in word[0]], [frozenset(x) for x in word[1]]))


@pytest.mark.parametrize(
    ("text", "states", "accepted", "rejected"),
    [
        ("{p;q}<>->r", 3, ["p", "qr", ""], ["p", "r", ""]),
        ("{p[*];q}!", 2, ["p", "p", "q"], ["p", "p", "p"]),
        ("{p[*];q}", 2, ["p", "p", "p"], ["p", "", "q"]),
        ("G{p;q}|=>r", 4, ["p", "q", "r"], ["p", "q", ""]),
        ("!{p[+];!p}", 2, [""], ["p", "p"]),
        # no word matches the first expression; what cannot be completed does not satisfy the closure
        ("!{p[+];!p;{p[*]&&{p[*];!p;p[*]}}}", 2, ["p", "p"], None),
        ("{p[->2]}[]->q", 3, ["p", "", "pq"], ["p", "", "p"]),
    ],
)
def test_examples(text, states, accepted, rejected):
    f = parse_in("spot", Fragment.whole(Source("t", text))).formula
    automaton = automaton_of(f)
    for letters, expected in ((accepted, True), (rejected, False)):
        if letters is None:
            continue
        *stem, last = [frozenset(x) for x in letters]
        assert evaluate(f, stem, [last]) is expected
        assert accepts(automaton, stem, [last]) is expected
    assert len(automaton.edges) <= states


def test_time_is_refused():
    f = apply("F<=", P, bound="500")
    assert atoms(f) == ("p",)
    with pytest.raises(Untranslatable, match="bound in time"):
        automaton_of(f)
