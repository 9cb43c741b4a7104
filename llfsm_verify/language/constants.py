"""What can be said of an expression without running it: its value when it is constant, and bounds of its value."""

from __future__ import annotations

from llfsm_verify.language import typed
from llfsm_verify.language.types import FixedType, RangeType


def divide(a: int, b: int) -> int:
    """C's division: the quotient truncated towards zero."""
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def evaluate(e: typed.Expression) -> int | bool | None:
    """The value of an expression of literals, None when it is not constant (or divides by zero)."""
    match e:
        case typed.Literal():
            return e.value
        case typed.Unary():
            operand = evaluate(e.operand)
            if operand is None:
                return None
            return not operand if e.op == "not" else -operand if e.op == "neg" else abs(operand)
        case typed.Binary():
            left, right = evaluate(e.left), evaluate(e.right)
            return None if left is None or right is None else _apply(e.op, left, right)
        case typed.Conditional():
            condition, then, otherwise = evaluate(e.condition), evaluate(e.then), evaluate(e.otherwise)
            return None if condition is None else then if condition else otherwise
    return None


def _apply(op: str, a: int, b: int) -> int | bool | None:
    match op:
        case "add":
            return a + b
        case "sub":
            return a - b
        case "mul":
            return a * b
        case "div":
            return divide(a, b) if b else None
        case "mod":
            return a - b * divide(a, b) if b else None
        case "min":
            return min(a, b)
        case "max":
            return max(a, b)
        case "eq":
            return a == b
        case "ne" | "xor":
            return a != b
        case "lt":
            return a < b
        case "le":
            return a <= b
        case "gt":
            return a > b
        case "ge":
            return a >= b
        case "and":
            return bool(a and b)
        case _:
            return bool(a or b)


Interval = tuple[int, int] | None
"""Lowest and highest possible value; None: no bounds known."""


def interval(e: typed.Expression) -> Interval:
    """Bounds of an integer expression, from the declared types of what it reads."""
    match e:
        case typed.Literal():
            return int(e.value), int(e.value)
        case typed.Read() | typed.ReadLocal():
            return (e.type.low, e.type.high) if isinstance(e.type, RangeType | FixedType) else None
        case typed.Choose():
            return e.low, e.high
        case typed.Unary():
            bounds = interval(e.operand)
            if bounds is None:
                return None
            low, high = bounds
            if e.op == "neg":
                return -high, -low
            return (0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))
        case typed.Conditional():
            then, otherwise = interval(e.then), interval(e.otherwise)
            return (
                None if then is None or otherwise is None else (min(then[0], otherwise[0]), max(then[1], otherwise[1]))
            )
        case typed.Binary():
            left, right = interval(e.left), interval(e.right)
            return None if left is None or right is None else _combine(e.op, left, right)
    return None


def _combine(op: str, a: tuple[int, int], b: tuple[int, int]) -> Interval:
    match op:
        case "add":
            return a[0] + b[0], a[1] + b[1]
        case "sub":
            return a[0] - b[1], a[1] - b[0]
        case "mul":
            corners = [x * y for x in a for y in b]
            return min(corners), max(corners)
        case "div":
            divisors = [d for d in (*b, -1, 1) if d and b[0] <= d <= b[1]]
            quotients = [divide(x, d) for x in a for d in divisors] or [0]
            return min(*quotients, *quotients), max(*quotients, *quotients)
        case "mod":
            largest = max(abs(b[0]), abs(b[1])) - 1
            return max(-largest, min(a[0], 0)), min(largest, max(a[1], 0))
        case "min":
            return min(a[0], b[0]), min(a[1], b[1])
        case "max":
            return max(a[0], b[0]), max(a[1], b[1])
    return None
