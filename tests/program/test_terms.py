"""Types of expressions are the smallest that hold their values."""

from __future__ import annotations

from itertools import combinations_with_replacement, product

import pytest

from llfsm_verify.program.program import BOOL, UNBOUNDED, Const, Get, Int, OpName, Type
from llfsm_verify.program.terms import const, ite, join, op, wrapped

DIGIT = Int(0, 9)


@pytest.mark.parametrize(
    ("a", "b", "both"),
    [
        (BOOL, BOOL, BOOL),
        (BOOL, DIGIT, DIGIT),
        (BOOL, Int(5, 9), DIGIT),
        (BOOL, Int(0, 1), Int(0, 1)),
        (Int(-3, 2), Int(1, 7), Int(-3, 7)),
        (DIGIT, UNBOUNDED, UNBOUNDED),
        (UNBOUNDED, BOOL, UNBOUNDED),
    ],
)
def test_a_choice_has_the_smallest_type_of_both_values(a: Type, b: Type, both: Type) -> None:
    assert join(a, b) == join(b, a) == both
    condition = Get("c", None, BOOL)
    assert ite(condition, Get("a", None, a), Get("b", None, b)).type == both


def test_what_fits_is_stored_as_it_is() -> None:
    number = Get("a", None, DIGIT)
    assert wrapped(number, Int(0, 9)) is number
    assert wrapped(number, Int(0, 8)).type == Int(0, 8)


INTERVALS = list(combinations_with_replacement(range(-3, 4), 2))


def values(name: OpName, *ranges: tuple[int, int]) -> set[int]:
    """Of all arguments in the ranges, without divisions by zero."""
    found = set()
    for arguments in product(*(range(low, high + 1) for low, high in ranges)):
        if name not in ("div", "mod") or arguments[1] != 0:
            folded = op(name, *map(const, arguments))
            assert isinstance(folded, Const)
            found.add(folded.value)
    return found


def bounds(name: OpName, *ranges: tuple[int, int]) -> tuple[int, int]:
    kind = op(name, *(Get(f"x{i}", None, Int(*r)) for i, r in enumerate(ranges))).type
    assert isinstance(kind, Int)
    return kind.low, kind.high


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div"])
def test_operations_have_the_smallest_types(name: OpName) -> None:
    for pair in product(INTERVALS, repeat=2):
        found = values(name, *pair) or {0}
        assert bounds(name, *pair) == (min(found), max(found)), pair


@pytest.mark.parametrize("name", ["neg", "abs"])
def test_operations_on_one_value_have_the_smallest_types(name: OpName) -> None:
    for interval in INTERVALS:
        found = values(name, interval)
        assert bounds(name, interval) == (min(found), max(found)), interval


def test_remainders_are_in_their_types() -> None:
    for pair in product(INTERVALS, repeat=2):
        low, high = bounds("mod", *pair)
        assert all(low <= value <= high for value in values("mod", *pair)), pair
    assert bounds("mod", (-9, 9), (-4, 3)) == (-3, 3)
    assert bounds("mod", (0, 9), (1, 4)) == (0, 3)
    assert bounds("mod", (-2, 0), (1, 8)) == (-2, 0)
    assert bounds("mod", (-9, 9), (-1, 1)) == bounds("mod", (-9, 9), (0, 0)) == (0, 0)


@pytest.mark.parametrize(
    ("a", "b", "quotient", "remainder"), [(7, 3, 2, 1), (-7, 3, -2, -1), (7, -3, -2, 1), (-7, -3, 2, -1), (6, 3, 2, 0)]
)
def test_division_goes_towards_zero(a: int, b: int, quotient: int, remainder: int) -> None:
    assert (op("div", const(a), const(b)), op("mod", const(a), const(b))) == (const(quotient), const(remainder))
