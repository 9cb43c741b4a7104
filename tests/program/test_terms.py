"""Types of expressions are the smallest that hold their values."""

from __future__ import annotations

from itertools import combinations_with_replacement, product

import pytest

from llfsm_verify.backends.reference import apply
from llfsm_verify.program.program import BOOL, INT64_MAX, INT64_MIN, UNBOUNDED, Const, Expr, Get, Int, Ite, OpName, Type
from llfsm_verify.program.program import Op as Operation
from llfsm_verify.program.terms import (
    FALSE,
    TRUE,
    conjunction,
    const,
    disjunction,
    get,
    interval,
    ite,
    join,
    may_overflow,
    op,
    truncated_div,
    wrap,
    wrapped,
)

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
    number = get("a", DIGIT)
    assert number == Get("a", None, DIGIT)
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


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div", "min", "max"])
def test_operations_have_the_smallest_types(name: OpName) -> None:
    for pair in product(INTERVALS, repeat=2):
        found = values(name, *pair) or {0}
        assert bounds(name, *pair) == (min(found), max(found)), pair


@pytest.mark.parametrize("name", ["neg", "abs"])
def test_operations_on_one_value_have_the_smallest_types(name: OpName) -> None:
    for one in INTERVALS:
        found = values(name, one)
        assert bounds(name, one) == (min(found), max(found)), one


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


NUMERIC: list[OpName] = ["add", "sub", "mul", "div", "mod", "min", "max", "eq", "ne", "lt", "le", "gt", "ge"]
LOGICAL: list[OpName] = ["and", "or", "xor", "eq", "ne"]


def evaluated(e: Expr, given: dict[str, int]) -> int:
    """By the interpreter's arithmetic; a value has to be in the type of its expression."""
    match e:
        case Const():
            value = e.value
        case Get():
            value = given[e.var]
        case Ite():
            value = evaluated(e.then if evaluated(e.condition, given) else e.otherwise, given)
        case Operation():
            value = apply(e, [evaluated(a, given) for a in e.args])
        case _:
            raise AssertionError(e)
    bounds = interval(e)
    assert bounds is None or bounds[0] <= value <= bounds[1]
    return value


@pytest.mark.parametrize(("names", "kind"), [(NUMERIC, Int(-3, 3)), (LOGICAL, BOOL)], ids=["numbers", "truth"])
def test_what_is_folded_has_the_value_of_what_is_not(names: list[OpName], kind: Int) -> None:
    """With constants in place of none, one or both operands."""
    for name, a, b in product(names, range(kind.low, kind.high + 1), range(kind.low, kind.high + 1)):
        if name in ("div", "mod") and b == 0:
            continue
        expected = apply(Operation(name, (), kind), [a, b])
        constants = [Const(x, BOOL) if kind is BOOL else const(x) for x in (a, b)]
        variables = [Get(v, None, kind) for v in "ab"]
        for sides in product(*zip(constants, variables, strict=True)):
            assert evaluated(op(name, *sides), {"a": a, "b": b}) == expected, (name, a, b, sides)


@pytest.mark.parametrize("name", ["neg", "abs"])
def test_one_number_is_folded(name: OpName) -> None:
    for a in range(-3, 4):
        assert op(name, const(a)) == const(apply(Operation(name, (), BOOL), [a]))


def test_truth_values_are_folded_to_truth_values() -> None:
    p, q = Get("p", None, BOOL), Get("q", None, BOOL)
    assert op("not", TRUE) == FALSE and op("not", FALSE) == TRUE
    assert op("not", op("not", p)) is p and op("not", p) == Operation("not", (p,), BOOL)
    assert op("lt", const(1), const(2)) == TRUE and op("ge", const(1), const(2)) == FALSE
    assert op("and", TRUE, p) is op("and", p, TRUE) is op("or", FALSE, p) is op("or", p, FALSE) is p
    assert op("and", FALSE, p) == op("and", p, FALSE) == FALSE and op("or", TRUE, p) == op("or", p, TRUE) == TRUE
    assert op("and", p, q) == Operation("and", (p, q), BOOL) and op("or", p, q) == Operation("or", (p, q), BOOL)
    assert conjunction([]) == TRUE and disjunction([]) == FALSE
    for a, b in product((0, 1), repeat=2):
        assert evaluated(conjunction([p, q, p]), {"p": a, "q": b}) == a & b
        assert evaluated(disjunction([p, q, p]), {"p": a, "q": b}) == a | b
    assert ite(TRUE, p, q) is p and ite(FALSE, p, q) is q


def test_nothing_is_divided_by_a_constant_zero_beforehand() -> None:
    for name in ("div", "mod"):
        assert op(name, const(3), const(0)) == Operation(name, (const(3), const(0)), Int(0, 0))
    assert op("sub", const(3), const(0)) == const(3)


def test_what_leaves_128_bits_is_not_folded_and_has_no_bounds() -> None:
    assert op("add", const(INT64_MAX), const(1)) == const(INT64_MAX + 1)
    assert op("sub", const(INT64_MIN), const(1)) == const(INT64_MIN - 1)
    n, highest, lowest = Get("n", None, Int(0, 1)), (1 << 128) - 1, -(1 << 127)
    for name, most, least in (("add", highest, highest - 1), ("sub", lowest, lowest + 1)):
        outside = op(name, const(most), const(1))
        assert outside == Operation(name, (const(most), const(1)), UNBOUNDED)
        assert interval(outside) is None and may_overflow(outside)
        assert op(name, const(most), n).type == UNBOUNDED
        inside = op(name, const(least), n)
        assert inside.type != UNBOUNDED and not may_overflow(inside)
    assert op("neg", Get("n", None, UNBOUNDED)).type == UNBOUNDED


def test_an_overflow_is_seen_wherever_it_is() -> None:
    wide, b, n = op("add", Get("n", None, UNBOUNDED), const(1)), Get("b", None, BOOL), Get("m", None, Int(0, 3))
    assert may_overflow(wide) is True and may_overflow(Get("n", None, UNBOUNDED)) is False
    test = op("eq", wide, const(0))
    for e in (
        test,
        op("not", test),
        op("and", b, test),
        op("and", test, b),
        ite(test, n, n),
        ite(b, wide, n),
        ite(b, n, wide),
        Get("a", wide, BOOL),
        op("not", Get("a", op("min", wide, n), BOOL)),
    ):
        assert may_overflow(e), e
    assert not may_overflow(ite(b, op("add", n, n), Get("a", n, DIGIT)))


@pytest.mark.parametrize("into", [Int(0, 3), Int(-3, 1), Int(5, 5), Int(-5, -3)])
def test_wrapping_keeps_the_remainder(into: Int) -> None:
    size = into.high - into.low + 1
    for value in range(-9, 10):
        found = wrap(value, into.low, into.high)
        assert into.low <= found <= into.high and (found - value) % size == 0
        assert wrapped(const(value), into) == const(found)


def test_only_what_fits_whole_is_not_wrapped() -> None:
    for low, high in combinations_with_replacement(range(-3, 4), 2):
        number = Get("a", None, Int(low, high))
        stored = wrapped(number, Int(-1, 2))
        assert (stored is number) == (low >= -1 and high <= 2)
        assert stored is number or stored == Operation("wrap", (number,), Int(-1, 2))
    unbounded = Get("a", None, UNBOUNDED)
    assert wrapped(unbounded, DIGIT) == Operation("wrap", (unbounded,), DIGIT)


def test_quotients_are_cut_towards_zero() -> None:
    for a, b in product(range(-7, 8), [*range(-3, 0), *range(1, 4)]):
        assert truncated_div(a, b) == int(a / b)
