"""Every operation in both theories, for all small values: what the reference interpreter says of it."""

from __future__ import annotations

from itertools import product

import pytest
import z3

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.backends.smt.arithmetic import Arithmetic, BitVectors, Integers, Term, choose, operate
from llfsm_verify.program.program import BOOL, Get, Int, Op, OpName, Type
from llfsm_verify.program.terms import op

NUMBERS, SHORT, DIGIT = Int(-4, 3), Int(-2, 2), Int(0, 5)
NUMERIC = ("add", "sub", "mul", "div", "mod", "min", "max", "eq", "ne", "lt", "le", "gt", "ge")
LOGICAL = ("and", "or", "xor", "eq", "ne")
TWO = [
    *((name, left, right) for name in NUMERIC for left, right in ((NUMBERS, SHORT), (DIGIT, NUMBERS), (BOOL, DIGIT))),
    *((name, BOOL, BOOL) for name in LOGICAL),
]
THEORIES: list[Arithmetic] = [Integers(), BitVectors()]


def put(theory: Arithmetic, made: Term, *known: tuple[Term, int]) -> int:
    """The value of a term where its unknowns have these."""
    found = z3.substitute(made.z3, *((x.z3, theory.literal(value, x.type).z3) for x, value in known))
    solver = z3.Solver(ctx=found.ctx)
    assert solver.check() == z3.sat
    return theory.value(solver.model(), Term(z3.simplify(found), made.type))


def typed(name: OpName, left: Int, right: Int) -> Type:
    """The exact type of an operation."""
    return op(name, Get("x", None, left), Get("y", None, right)).type


def values(kind: Int) -> range:
    return range(kind.low, kind.high + 1)


@pytest.mark.parametrize("theory", THEORIES, ids=lambda theory: theory.name)
@pytest.mark.parametrize(("name", "left", "right"), TWO, ids=str)
def test_operations_on_two(theory: Arithmetic, name: OpName, left: Int, right: Int) -> None:
    expression = Op(name, (Get("x", None, left), Get("y", None, right)), typed(name, left, right))
    x, y = theory.constant("x", left), theory.constant("y", right)
    made = operate(theory, name, (x, y), expression.type)
    for a, b in product(values(left), values(right)):
        if b or name not in ("div", "mod"):
            known = {"x": a, "y": b}
            assert put(theory, made, (x, a), (y, b)) == evaluate(expression, known, {}), known
            folded = operate(theory, name, (x, theory.literal(b, Int(b, b))), expression.type)
            assert put(theory, folded, (x, a)) == evaluate(expression, known, {}), known


@pytest.mark.parametrize("theory", THEORIES, ids=lambda theory: theory.name)
@pytest.mark.parametrize(
    ("name", "kind"), [("neg", NUMBERS), ("abs", NUMBERS), ("neg", DIGIT), ("not", BOOL), ("neg", BOOL)], ids=str
)
def test_operations_on_one(theory: Arithmetic, name: str, kind: Int) -> None:
    expression = op(name, Get("x", None, kind))
    x = theory.constant("x", kind)
    made = operate(theory, name, (x,), expression.type)
    for a in values(kind):
        assert put(theory, made, (x, a)) == evaluate(expression, {"x": a}, {}), a


@pytest.mark.parametrize("theory", THEORIES, ids=lambda theory: theory.name)
@pytest.mark.parametrize("into", [Int(0, 3), Int(-4, 3), Int(-8, 7), Int(0, 15)], ids=str)
def test_wrapping(theory: Arithmetic, into: Int) -> None:
    kind = Int(-40, 50)
    expression, x = Op("wrap", (Get("x", None, kind),), into), theory.constant("x", kind)
    made = operate(theory, "wrap", (x,), into)
    for a in values(kind):
        assert put(theory, made, (x, a)) == evaluate(expression, {"x": a}, {}), a


@pytest.mark.parametrize("theory", THEORIES, ids=lambda theory: theory.name)
def test_choices_and_types(theory: Arithmetic) -> None:
    c, x, y = (theory.constant(name, kind) for name, kind in (("c", DIGIT), ("x", NUMBERS), ("y", BOOL)))
    kinds: list[Type] = [NUMBERS, Int(-5, 9)]
    for kind in kinds:
        made = choose(theory, c, x, y, kind)
        for a, b, d in product((0, 1, 9), values(NUMBERS), (0, 1)):
            assert put(theory, made, (c, a), (x, b), (y, d)) == (b if a else d)
    wide = Int(-9, 9)
    for kind in (NUMBERS, DIGIT, BOOL, Int(0, 7)):
        unknown = theory.constant("v", kind)
        solver, found = z3.Solver(), set[int]()
        solver.add(theory.within(unknown))
        while solver.check() == z3.sat:
            value = theory.value(solver.model(), unknown)
            found.add(value)
            solver.add(theory.compare("ne", theory.cast(unknown, wide), theory.literal(value, wide)))
        assert found == set(values(kind))
    assert put(theory, theory.literal(3, Int(3, 3))) == 3
