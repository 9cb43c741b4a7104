"""What can be said of an expression without running it: its value when it is constant, and bounds of its value."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from fractions import Fraction
from math import ceil, floor, isqrt, trunc

from llfsm_verify.language import typed
from llfsm_verify.language.types import DecimalType, FixedType, RangeType, Type, digits_of

Number = int | Fraction
"""A truth value, an integer, the index of an enumerator, or a decimal."""


def evaluate(e: typed.Expression) -> Number | None:
    """The value of an expression of literals, None when it is not constant (or divides by zero)."""
    match e:
        case typed.Literal():
            return _natural(e.value, e.type)
        case typed.Unary():
            operand = evaluate(e.operand)
            return None if operand is None else _unary(e, operand)
        case typed.Binary():
            left, right = evaluate(e.left), evaluate(e.right)
            if left is None or right is None:
                return None
            if isinstance(e.type, FixedType):
                return _bits(e.op, int(left), int(right), e.type)
            if e.op == "div":
                return _quotient(left, right, digits_of(e.type)) if right else None
            return OPERATIONS[e.op](left, right)
        case typed.Conditional():
            condition, then, otherwise = evaluate(e.condition), evaluate(e.then), evaluate(e.otherwise)
            return None if condition is None else then if condition else otherwise
        case typed.LetIn():
            return evaluate(e.value)  # what is defined is not looked into
    return None


def _unary(e: typed.Unary, operand: Number) -> Number | None:
    match e.op:
        case "bnot":
            assert isinstance(e.type, FixedType)
            return e.type.low + e.type.high - operand
        case "not":
            return not operand
        case "neg":
            return -1 * operand
        case "abs":
            return _size(operand)
        case "floor":
            return floor(operand)
        case "ceil":
            return ceil(operand)
        case "round":
            return floor(operand + Fraction(1, 2)) if operand >= 0 else ceil(operand - Fraction(1, 2))
    digits = digits_of(e.type)
    if operand < 0:
        return None
    root = isqrt(int(operand * 100**digits))
    return Fraction(root, 10**digits) if digits else root


def _bits(op: str, a: int, b: int, kind: FixedType) -> int | None:
    """A bit operation in two's complement; None: it is shifted by too much."""
    if op in ("shl", "shr") and not 0 <= b < kind.bits:
        return None
    found = {"band": a & b, "bor": a | b, "bxor": a ^ b, "shl": a << b if b >= 0 else 0, "shr": a >> max(b, 0)}[op]
    return (found - kind.low) % (1 << kind.bits) + kind.low


def _size(value: Number) -> Number:
    return value if value >= 0 else -1 * value


def _quotient(a: Number, b: Number, digits: int) -> Number:
    """A / b, truncated towards zero to so many digits."""
    if not digits:
        return trunc(Fraction(a) / Fraction(b))
    return Fraction(trunc(Fraction(a) / Fraction(b) * 10**digits), 10**digits)


OPERATIONS: Mapping[str, Callable[[Number, Number], Number | None]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "min": min, "max": max,
    "div": lambda a, b: _quotient(a, b, 0) if b else None,
    "mod": lambda a, b: a - b * _quotient(a, b, 0) if b else None,
    "eq": operator.eq, "ne": operator.ne, "xor": operator.ne, "lt": operator.lt, "le": operator.le,
    "gt": operator.gt, "ge": operator.ge, "and": lambda a, b: bool(a and b), "or": lambda a, b: bool(a or b),
}  # fmt: skip


Interval = tuple[Number, Number] | None
"""Lowest and highest possible value; None: no bounds known."""


def interval(e: typed.Expression) -> Interval:
    """Bounds of a number, from the declared types of what it reads."""
    match e:
        case typed.Literal():
            value = _natural(int(e.value), e.type)
            return value, value
        case typed.Read() | typed.ReadLocal() | typed.Sampled():
            return _declared(e.type)
        case typed.Lookup() | typed.LetIn():
            return _declared(e.type)
        case typed.Choose():
            return _natural(e.low, e.type), _natural(e.high, e.type)
        case typed.Unary():
            bounds = interval(e.operand)
            if bounds is None:
                return None
            low, high = bounds
            if isinstance(e.type, FixedType):
                return e.type.low, e.type.high
            if e.op in ("floor", "ceil", "round"):
                ends = [_unary(e, bound) for bound in bounds]
                return None if ends[0] is None or ends[1] is None else (ends[0], ends[1])
            if e.op == "sqrt":
                return 0, _unary(e, max(high, 0)) or 0
            if e.op == "neg":
                return -high, -low
            return (0 if low <= 0 <= high else min(_size(low), _size(high))), max(_size(low), _size(high))
        case typed.Conditional():
            then, otherwise = interval(e.then), interval(e.otherwise)
            return (
                None if then is None or otherwise is None else (min(then[0], otherwise[0]), max(then[1], otherwise[1]))
            )
        case typed.Binary():
            left, right = interval(e.left), interval(e.right)
            if isinstance(e.type, FixedType):
                return e.type.low, e.type.high
            if left is None or right is None:
                return None
            return _combine(e.op, left, right, digits_of(e.type), digits_of(e.right.type))
    return None


def longest(after: typed.After) -> Fraction | None:
    """The longest time in ms that an `after` can wait for, None when nothing bounds it."""
    if isinstance(after.bound, Fraction):
        return after.bound
    bounds = interval(after.bound)
    return None if bounds is None else Fraction(max(bounds[1], 0) * after.scale)


def _natural(value: int, kind: Type) -> Number:
    """The number that `value` is in the steps of its type."""
    return Fraction(value, 10**kind.digits) if isinstance(kind, DecimalType) else value


def _declared(kind: Type) -> Interval:
    if isinstance(kind, DecimalType) and kind.low is not None and kind.high is not None:
        return _natural(kind.low, kind), _natural(kind.high, kind)
    return (kind.low, kind.high) if isinstance(kind, RangeType | FixedType) else None


def _combine(
    op: str, a: tuple[Number, Number], b: tuple[Number, Number], digits: int = 0, of_divisor: int = 0
) -> Interval:
    """The bounds of an operation, whose result has so many digits, as its right side has `of_divisor`."""
    match op:
        case "add":
            return a[0] + b[0], a[1] + b[1]
        case "sub":
            return a[0] - b[1], a[1] - b[0]
        case "mul":
            corners: list[Number] = [x * y for x in a for y in b]
            return min(corners), max(corners)
        case "div":
            least = Fraction(1, 10**of_divisor)
            ends: list[Number] = [*b, -least, least]
            divisors = [d for d in ends if d and b[0] <= d <= b[1]]
            quotients = [_quotient(x, d, digits) for x in a for d in divisors] or [0]
            return min(quotients), max(quotients)
        case "mod":
            largest = max(_size(b[0]), _size(b[1])) - 1
            return max(-largest, min(a[0], 0)), min(largest, max(a[1], 0))
        case "min":
            return min(a[0], b[0]), min(a[1], b[1])
        case "max":
            return max(a[0], b[0]), max(a[1], b[1])
    return None
