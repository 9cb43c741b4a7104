"""Constants put into formulas: what is folded means the same, and no constant is left where it says nothing."""

from __future__ import annotations

from itertools import product

import pytest

from llfsm_verify.logic.formula import EXTENDED_ARITY, FALSE, TRUE, Formula, Op, apply, atom, negation, postorder
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.strengthening import Occurrence, consequent, parts, replace_subformula

P, Q = atom("p"), atom("q")
LETTERS = [frozenset[str](), frozenset("p"), frozenset("q"), frozenset("pq")]
WORDS = [(stem, loop) for stem in product(LETTERS, repeat=2) for loop in product(LETTERS, repeat=2)]
UNARY = ("not", "X", "F", "G", "Y", "Z", "O", "H")
BINARY = ("and", "or", "implies", "U", "W", "R", "M", "S", "T")
PLACES = [*((op, 0) for op in UNARY), *((op, i) for op in BINARY for i in (0, 1))]


@pytest.mark.parametrize(("op", "place"), PLACES, ids=[f"{op} {i}" for op, i in PLACES])
@pytest.mark.parametrize("by", [TRUE, FALSE], ids=["true", "false"])
def test_a_folded_constant_means_the_same(op: str, place: int, by: Formula) -> None:
    args = (P,) if op in UNARY else (P, Q)
    formula = negation(P) if op == "not" else apply(op, *args)  # type: ignore[arg-type]
    found = replace_subformula(formula, (place,), by)
    for stem, loop in WORDS:
        # The atom itself made constant in every letter says what is meant.
        key = "pq"[place]
        with_it = [[letter | {key} if by is TRUE else letter - {key} for letter in part] for part in (stem, loop)]
        assert evaluate(found, stem, loop) == evaluate(formula, *with_it), found
    if op not in ("Y", "Z"):
        assert found in (TRUE, FALSE) or not {TRUE, FALSE} & set(postorder(found))


@pytest.mark.parametrize("op", ["O[]", "H[]", "S[]", "T[]", "O<=", "H<=", "S<=", "T<="])
@pytest.mark.parametrize("bound", ["0:1", "1:2"])
@pytest.mark.parametrize("by", [TRUE, FALSE], ids=["true", "false"])
def test_a_folded_constant_means_the_same_where_the_past_has_bounds(op: Op, bound: str, by: Formula) -> None:
    args = (P, Q)[: EXTENDED_ARITY[op]]
    formula = apply(op, *args, bound=bound)
    for place, key in enumerate("pq"[: len(args)]):
        found = apply("G", replace_subformula(formula, (place,), by))
        for stem, loop in WORDS:
            with_it = [[letter | {key} if by is TRUE else letter - {key} for letter in part] for part in (stem, loop)]
            delays = [0, 1, 0, 1]
            assert evaluate(found, stem, loop, delays) == evaluate(apply("G", formula), *with_it, delays), found


def test_a_constant_is_folded_as_far_as_it_reaches() -> None:
    inner = apply("and", P, apply("X", Q))
    formula = apply("G", apply("implies", P, apply("F", inner)))
    assert replace_subformula(formula, (0, 1, 0, 1, 0), FALSE) is apply("G", negation(P))
    assert replace_subformula(formula, (0, 1, 0, 1, 0), TRUE) is apply("G", apply("implies", P, apply("F", P)))
    assert replace_subformula(formula, (), TRUE) is TRUE
    assert replace_subformula(apply("xor", P, Q), (0,), Q) is apply("xor", Q, Q)


def test_where_arguments_stand() -> None:
    formula = apply("implies", P, negation(Q))
    found = [(o.node, o.path, o.negative) for o in parts(Occurrence(formula))]
    assert found == [(P, (0,), True), (negation(Q), (1,), False)]
    (inner,) = parts(Occurrence(negation(Q), (1,), False))
    assert (inner.node, inner.path, inner.negative) == (Q, (1, 0), True)
    assert list(parts(Occurrence(apply("xor", P, Q)))) == list(parts(Occurrence(apply("iff", P, Q)))) == []
    assert consequent(Occurrence(formula)) == Occurrence(negation(Q), (1,), False)
    assert consequent(Occurrence(formula, (0,), True)) is None
    assert consequent(Occurrence(apply("or", P, Q))) is None
    assert (Occurrence(P).extreme, Occurrence(P, (), True).extreme) == (FALSE, TRUE)
