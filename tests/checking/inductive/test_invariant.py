"""A solver's terms, read as expressions, have the values that the solver gives them."""

from __future__ import annotations

from itertools import product

import pytest
import z3

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.checking.inductive.invariant import Unreadable, read
from llfsm_verify.semantics.program import Get, Int

X, Y = z3.Ints("x y")
P, Q = z3.Bools("p q")
NUMBER, BOOL = Int(-7, 7), Int(0, 1, boolean=True)
NAMES = {term.get_id(): Get(str(term), None, kind) for term, kind in ((X, NUMBER), (Y, NUMBER), (P, BOOL), (Q, BOOL))}


@pytest.mark.parametrize(
    "term",
    [
        X / 3 == Y,
        X / 1 + Y / 7 > 0,
        X % 3 == Y,
        (X + Y) % 5 < 2,
        z3.If(X > Y, X, Y) - Y * 2 <= -X,
        z3.Implies(P, X >= Y),
        z3.Xor(P, Q),
        z3.Distinct(X, Y, z3.IntVal(2)),
        z3.And(Q, X != Y) == P,
        z3.Or(z3.Not(P), Q, X < Y),
    ],
    ids=str,
)
def test_the_values_are_the_solvers(term: z3.BoolRef) -> None:
    found = read(term, NAMES)
    values = set()
    for x, y, p, q in product(range(-7, 8, 2), range(-7, 8, 3), (0, 1), (0, 1)):
        given = [(X, z3.IntVal(x)), (Y, z3.IntVal(y)), (P, z3.BoolVal(bool(p))), (Q, z3.BoolVal(bool(q)))]
        expected = z3.is_true(z3.simplify(z3.substitute(term, *given)))
        assert evaluate(found, {"x": x, "y": y, "p": p, "q": q}, {}) == int(expected)
        values.add(expected)
    assert values == {False, True}


@pytest.mark.parametrize("term", [X / Y == 1, X % Y == 1, X / 0 == 1, X / -2 == 1, X % -2 == 1], ids=str)
def test_division_is_by_a_positive_constant(term: z3.BoolRef) -> None:
    with pytest.raises(Unreadable, match="it divides by what is no positive constant"):
        read(term, NAMES)
