"""Formulas are hash-consed, of any depth, and print as they are read."""

import copy
import gc
import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic import formula as fm
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, atoms, depth, negation, postorder, size, to_text
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.testing.formulas import formulas
from tests.quick import examples

P, Q, R = atom("p"), atom("q"), atom("r")
KEYS = ("p", "G", "x == 3", "m@RED", "a ? b : c", "-3 < x", "not p", "a[2].x + 1 > -y", "true", "f(p, -1)")


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


def test_equal_formulas_are_one_object():
    assert apply("U", P, apply("X", Q)) is apply("U", P, apply("X", Q))
    assert apply("and", P, Q) is not apply("and", Q, P)
    assert apply("and", apply("and", P, Q), P).args == (P, Q, P)
    assert negation(negation(P)) is P


def test_wrong_numbers_of_arguments_are_refused():
    for op, args in (("U", (P,)), ("and", (P,)), ("X", (P, Q)), ("atom", ()), ("true", (P,))):
        with pytest.raises(ValueError, match=r"arguments"):
            apply(op, *args)
    with pytest.raises(ValueError, match="key"):
        atom("")


@pytest.mark.slow
def test_unused_formulas_are_forgotten():
    gc.collect()
    before = len(fm._table)
    many = [atom(f"forgotten{i}") for i in range(100)]
    assert len(fm._table) == before + 100
    del many
    assert len(fm._table) == before


@pytest.mark.slow
def test_depth_is_no_crash():
    deep = P
    for i in range(100_000):
        deep = apply("X" if i % 2 else "F", deep)
    assert size(deep) == depth(deep) + 1 == 100_001
    assert atoms(deep) == ("p",)
    assert to_text(deep).startswith("X F X F X F")
    assert len(repr(deep)) < 120
    assert size(nnf(deep, True)) > 50_000
    assert pickle.loads(pickle.dumps(deep)) is deep
    del deep


def test_sizes_count_shared_parts_once():
    doubled = P
    for _ in range(60):
        doubled = apply("xor", doubled, apply("X", doubled))
    assert size(doubled) == 121
    assert len(repr(doubled)) < 120
    assert size(nnf(doubled)) < 1_000


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=10))
@settings(max_examples=examples(300), deadline=None)
def test_printing_and_reading_are_inverse(f):
    # Reading cancels double negations, and nothing else.
    assert parsed(to_text(f)) is _cancelled(f)


def _cancelled(f):
    done = {}
    for node in postorder(f):
        args = [done[a] for a in node.args]
        done[node] = node if not args else negation(args[0]) if node.op == "not" else apply(node.op, *args)
    return done[f]


@given(formulas(max_leaves=8))
@settings(max_examples=examples(100), deadline=None)
def test_pickling_keeps_identity(f):
    assert pickle.loads(pickle.dumps(f)) is f
    assert copy.deepcopy(f) is f


@given(formulas(max_leaves=8), st.booleans())
@settings(max_examples=examples(200), deadline=None)
def test_negation_normal_form_is_one(f, negate):
    for node in postorder(nnf(f, negate)):
        assert node.op not in ("xor", "iff", "implies")
        assert node.op != "not" or node.args[0].op == "atom"
        assert node.op in ("true", "false") or not {TRUE, FALSE} & set(node.args)
    assert nnf(nnf(f, negate)) is nnf(f, negate)


@pytest.mark.parametrize("op", ["U", "W", "R", "M", "S", "T"])
def test_binary_operators_bind_between_and_and_not(op):
    inner = apply(op, P, Q)
    texts = {
        to_text(apply("and", inner, R)): f"p {op} q && r",
        to_text(apply("or", R, inner)): f"r || p {op} q",
        to_text(apply(op, apply("and", P, Q), R)): f"(p && q) {op} r",
        to_text(apply(op, inner, R)): f"(p {op} q) {op} r",
        to_text(apply(op, P, apply(op, Q, R))): f"p {op} (q {op} r)",
        to_text(apply(op, P, apply("U", Q, R))): f"p {op} (q U r)",
        to_text(apply("W", inner, R)): f"(p {op} q) W r",
        to_text(negation(inner)): f"!(p {op} q)",
        to_text(apply("G", inner)): f"G (p {op} q)",
        to_text(apply(op, apply("H", P), negation(Q))): f"H p {op} !q",
        to_text(apply("iff", P, apply(op, Q, R))): f"p <-> q {op} r",
    }
    assert list(texts) == list(texts.values())


def test_connectives_have_the_brackets_that_they_need():
    ops = ("and", "or", "xor", "implies", "iff")
    signs = dict(zip(ops, ("&&", "||", "xor", "->", "<->"), strict=True))
    level = dict(zip(ops, (5, 3, 4, 2, 1), strict=True))
    for outer in ops:
        for inner in ops:
            text = f"p {signs[inner]} q"
            bare = level[inner] > level[outer] or (inner == outer and inner in ("and", "or"))
            part = text if bare else f"({text})"
            assert to_text(apply(outer, apply(inner, P, Q), R)) == f"{part} {signs[outer]} r"
            assert to_text(apply(outer, R, apply(inner, P, Q))) == f"r {signs[outer]} {part}"
