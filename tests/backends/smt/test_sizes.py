"""The bits that suffice for the values of expressions: never fewer than a value takes, and exact for what bounds it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.backends.smt.relation import ANY_BITS, MAX_BITS, NumberTooLarge, multiplies, size_of
from llfsm_verify.program.program import BOOL, UNBOUNDED, Const, Expr, Get, Int, Ite, Local, Op
from tests.quick import examples

BITS = {("x", None): 5, ("y", None): 9, ("a", 0): 3, ("a", 1): 7}
X, Y = Get("x", None, UNBOUNDED), Get("y", None, UNBOUNDED)
FAR = Get("far", None, UNBOUNDED)


@pytest.mark.parametrize(
    ("expression", "bits"),
    [
        (Const(0, Int(0, 0)), 0), (Const(255, Int(255, 255)), 8), (Const(-8, Int(-8, -8)), 4),
        (X, 5), (FAR, ANY_BITS), (Get("byte", None, Int(0, 255)), 8), (Get("signed", None, Int(-300, 2)), 9),
        (Get("one", None, Int(7, 7)), 3), (Get("flag", None, BOOL), 1),
        (Get("a", Const(1, Int(1, 1)), UNBOUNDED), 7), (Get("a", X, UNBOUNDED), 7), (Get("b", X, UNBOUNDED), ANY_BITS),
        (Local("t", UNBOUNDED), 11), (Local("u", UNBOUNDED), ANY_BITS), (Local("t", Int(0, 3)), 2),
        (Op("add", (X, Y), UNBOUNDED), 10), (Op("sub", (X, Y), UNBOUNDED), 10), (Op("mul", (X, Y), UNBOUNDED), 14),
        (Op("div", (X, Y), UNBOUNDED), 5), (Op("mod", (X, Y), UNBOUNDED), 5), (Op("mod", (Y, X), UNBOUNDED), 5),
        (Op("neg", (Y,), UNBOUNDED), 9), (Op("max", (X, Y), UNBOUNDED), 9), (Op("mul", (X, Y), Int(0, 15)), 4),
        (Ite(Get("flag", None, BOOL), X, Y, UNBOUNDED), 9),
    ],
)  # fmt: skip
def test_bits_of(expression: Expr, bits: int) -> None:
    assert size_of(expression, BITS, {"t": 11}) == bits


def test_what_takes_more_than_the_limit_is_refused_on_the_way_too() -> None:
    large = Get("large", None, UNBOUNDED)
    whole, half = {("large", None): MAX_BITS}, {("large", None): MAX_BITS // 2}
    assert size_of(large, whole, {}) == MAX_BITS
    assert size_of(Op("mul", (large, large), UNBOUNDED), half, {}) == MAX_BITS
    for wrong in (Op("add", (large, X), UNBOUNDED), Op("div", (Op("mul", (large, X), UNBOUNDED), large), UNBOUNDED)):
        with pytest.raises(NumberTooLarge, match=f"more than {MAX_BITS:,} bits"):
            size_of(wrong, {**whole, **BITS}, {})


def test_only_products_without_bounds_multiply() -> None:
    product = Op("mul", (X, Y), UNBOUNDED)
    assert multiplies([X, Op("neg", (product,), UNBOUNDED)])
    assert not multiplies([X, Op("mul", (X, Y), Int(0, 15)), Op("add", (X, Y), UNBOUNDED)])


def _value(e: Expr, values: dict[str, int]) -> int:
    match e:
        case Const(value, _):
            return value
        case Get(name, _, _):
            return values[name]
        case Op(op, args, _):
            a, *rest = (_value(arg, values) for arg in args)
            b = rest[0] if rest else 0
            if op in ("div", "mod"):
                b = b or 1
                quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
                return quotient if op == "div" else a - quotient * b
            return {"add": a + b, "sub": a - b, "mul": a * b, "neg": -a, "abs": abs(a), "min": min(a, b),
                    "max": max(a, b)}[op]  # fmt: skip
    raise AssertionError(e)


def _expressions() -> st.SearchStrategy[Expr]:
    leaves = st.sampled_from([X, Y]) | st.integers(-40, 40).map(lambda n: Const(n, Int(n, n)))
    two = st.sampled_from(["add", "sub", "mul", "div", "mod", "min", "max"])
    return st.recursive(
        leaves,
        lambda inner: (
            st.builds(lambda op, a, b: Op(op, (a, b), UNBOUNDED), two, inner, inner)
            | st.builds(lambda op, a: Op(op, (a,), UNBOUNDED), st.sampled_from(["neg", "abs"]), inner)
        ),
        max_leaves=8,
    )


@given(_expressions(), st.integers(-31, 31), st.integers(-511, 511))
@settings(max_examples=examples(300), deadline=None)
def test_the_bits_suffice(expression: Expr, x: int, y: int) -> None:
    assert _value(expression, {"x": x, "y": y}).bit_length() <= size_of(expression, BITS, {})
