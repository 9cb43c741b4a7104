"""Expressions mean what they mean in C: against an evaluator of its own over random expression trees."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language.constants import OPERATIONS, _combine, evaluate, interval
from llfsm_verify.language.expressions import ExpressionChecker
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.scope import Constant, Scope
from llfsm_verify.language.types import IntType
from tests.quick import examples

NAMES = {"a": 3, "b": -7, "c": 0, "d": 12}
SCOPE = Scope(
    variables={},
    constants={n: Constant(v, IntType()) for n, v in NAMES.items()},
    machines={},
    others=(),
    self_name="",
    types={},
    enumerators={},
    inputs=frozenset(),
)


@dataclass(frozen=True)
class Tree:
    """A random expression: its text with as few brackets as C needs, its precedence in C, and its value."""

    text: str
    level: int
    value: int | bool | None
    """None: it divides by zero somewhere that is evaluated or not."""


LEVELS = {"||": 1, "&&": 2, "==": 3, "!=": 3, "<": 4, "<=": 4, ">": 4, ">=": 4, "+": 5, "-": 5, "*": 6, "/": 6, "%": 6}


def c_quotient(a: int, b: int) -> int:
    return int(a / b) if abs(a) < 2**50 and abs(b) < 2**50 else (a // b if a * b >= 0 else -(-a // b))


def apply(op: str, a: int, b: int) -> int | bool | None:
    if op in "/%":
        if b == 0:
            return None
        q = c_quotient(a, b)
        return q if op == "/" else a - b * q
    table = {
        "||": lambda: bool(a) or bool(b), "&&": lambda: bool(a) and bool(b), "==": lambda: a == b, "!=": lambda: a != b,
        "<": lambda: a < b, "<=": lambda: a <= b, ">": lambda: a > b, ">=": lambda: a >= b,
        "+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b,
    }  # fmt: skip
    return table[op]()


def bracket(tree: Tree, level: int) -> str:
    return tree.text if tree.level >= level else f"({tree.text})"


def combine(op: str, left: Tree, right: Tree) -> Tree:
    level = LEVELS[op]
    left_level = level + 1 if level in (3, 4) else level  # a comparison of comparisons needs brackets
    text = f"{bracket(left, left_level)} {op} {bracket(right, level + 1)}"
    if left.value is None or right.value is None:
        return Tree(text, level, None)
    return Tree(text, level, apply(op, left.value, right.value))


def negate(op: str, t: Tree) -> Tree:
    value = None if t.value is None else (not t.value) if op == "!" else -t.value
    return Tree(f"{op} {bracket(t, 7)}", 7, value)


def choose(c: Tree, a: Tree, b: Tree) -> Tree:
    value = None if None in (c.value, a.value, b.value) else a.value if c.value else b.value
    return Tree(f"{bracket(c, 1)} ? {a.text} : {b.text}", 0, value)


def call(name: str, a: Tree, b: Tree) -> Tree:
    value = None if a.value is None or b.value is None else {"min": min, "max": max}[name](a.value, b.value)
    return Tree(f"{name}({a.text}, {b.text})", 8, value)


leaves = st.sampled_from([Tree(n, 8, v) for n, v in NAMES.items()]) | st.integers(0, 20).map(
    lambda n: Tree(str(n), 8, n)
)
integers = st.deferred(lambda: leaves | compound_integers)
booleans = st.deferred(
    lambda: (
        st.builds(combine, st.sampled_from(["==", "!=", "<", "<=", ">", ">="]), integers, integers)
        | st.builds(combine, st.sampled_from(["&&", "||", "==", "!="]), booleans, booleans)
        | st.builds(negate, st.just("!"), booleans)
        | st.sampled_from([Tree("true", 8, True), Tree("false", 8, False)])
    )
)
compound_integers = (
    st.builds(combine, st.sampled_from(["+", "-", "*", "/", "%"]), integers, integers)
    | st.builds(negate, st.just("-"), integers)
    | st.builds(choose, booleans, integers, integers)
    | st.builds(call, st.sampled_from(["min", "max"]), integers, integers)
)


def check(text: str) -> int | bool | str | None:
    fragment = Fragment.whole(Source("c", text))
    try:
        e = ExpressionChecker(SCOPE, fragment).expression(parse_guard(fragment).root)
    except DiagnosticError as error:
        return error.diagnostics[0].code
    bounds = interval(e)
    value = evaluate(e)
    if bounds is not None and value is not None and not isinstance(value, bool):
        assert bounds[0] <= value <= bounds[1]
    return value


@pytest.mark.slow
@settings(max_examples=examples(80), deadline=None)
@given(integers | booleans)
def test_value_is_that_of_c(tree: Tree) -> None:
    value = check(tree.text)
    if tree.value is None:
        assert value is None or value == "E130"
    elif value not in ("E129", "E107"):
        assert (value, type(value)) == (tree.value, type(tree.value))


def test_division_truncates() -> None:
    assert [check(t) for t in ("7 / 2", "-7 / 2", "7 / -2", "-7 % 3", "7 % -3")] == [3, -3, -3, -1, 1]


def test_long_sums_are_grouped_without_changing_them() -> None:
    signs = ["+", "-", "-", "+", "-"]
    text = "1" + "".join(f" {signs[i % 5]} {i}" for i in range(2, 900))
    assert check(text) == eval(text)
    assert check("a" + " * 1" * 900) == 3


def test_hexadecimal_and_binary() -> None:
    assert check("0x1F + 0b101") == 36


def test_smallest_and_largest_number() -> None:
    assert check("-9223372036854775808 + 9223372036854775807") == -1


ENDS = [(0, 0), (0, 3), (-3, 0), (-4, 5), (2, 2), (2, 6), (-6, -2), (-1, 1), (7, 9)]
EXACT = ("add", "sub", "mul", "div", "min", "max")


@pytest.mark.parametrize("op", [*EXACT, "mod"])
def test_the_bounds_of_an_operation_hold_its_values(op: str) -> None:
    for a, b in product(ENDS, ENDS):
        values = [OPERATIONS[op](x, y) for x in range(a[0], a[1] + 1) for y in range(b[0], b[1] + 1)]
        known = [v for v in values if v is not None]
        bounds = _combine(op, a, b)
        assert bounds is not None
        if known:
            assert bounds[0] <= min(known) and max(known) <= bounds[1]
        if known and op in EXACT:
            assert bounds == (min(known), max(known)), (a, b)


@pytest.mark.parametrize(
    ("a", "b", "bounds"),
    [
        ((0, 99), (1, 4), (0, 3)),
        ((0, 2), (5, 7), (0, 2)),
        ((-9, 9), (-4, 2), (-3, 3)),
        ((-2, -1), (3, 3), (-2, 0)),
        ((5, 9), (-8, -8), (0, 7)),
    ],
)
def test_a_remainder_is_smaller_than_both(a: tuple[int, int], b: tuple[int, int], bounds: tuple[int, int]) -> None:
    assert _combine("mod", a, b) == bounds


def test_operations_without_bounds_have_none() -> None:
    assert _combine("eq", (0, 1), (0, 1)) is None
