"""Smart constructors of step-program expressions: exact interval types and constant folding."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    UNBOUNDED,
    Const,
    Expr,
    Get,
    Int,
    Ite,
    OpName,
    Type,
    Unbounded,
)
from llfsm_verify.program.program import Op as _Op

TRUE = Const(1, BOOL)
FALSE = Const(0, BOOL)

Interval = tuple[int, int]


class TooWideError(ValueError):
    """An operation on bounded values may leave 128 bits."""


def fits(low: int, high: int) -> bool:
    """Numbers between these fit in 128 bits, with a sign or, where none is negative, without."""
    lowest, highest = (0, 1 << 128) if low >= 0 else (-(1 << 127), 1 << 127)
    return lowest <= low and high < highest


def is_wide(kind: Type) -> bool:
    """Values of the type do not fit in 64 bits with a sign."""
    return isinstance(kind, Int) and (kind.low < INT64_MIN or kind.high > INT64_MAX)


@lru_cache(maxsize=4096, typed=True)
def const(value: int) -> Const:
    """An integer constant; its type is the single value."""
    return Const(value, Int(value, value))


def get(var: str, kind: Type) -> Get:
    return Get(var, None, kind)


def interval(e: Expr) -> Interval | None:
    """The values an expression can have, or None when nothing bounds them."""
    if isinstance(e, Const):
        return e.value, e.value
    return (e.type.low, e.type.high) if isinstance(e.type, Int) else None


def truncated_div(a: int, b: int) -> int:
    """C's division: towards zero. `b` is not zero."""
    q = abs(a) // abs(b)
    return q if (a < 0) == (b < 0) else -q


def wrap(value: int, low: int, high: int) -> int:
    """`value` modulo the size of `low` … `high`, brought into it."""
    return (value - low) % (high - low + 1) + low


FOLD: dict[str, Callable[..., int]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": truncated_div,
    "mod": lambda a, b: a - b * truncated_div(a, b),
    "neg": lambda a: -a,
    "abs": abs,
    "min": min,
    "max": max,
    "eq": lambda a, b: int(a == b),
    "ne": lambda a, b: int(a != b),
    "lt": lambda a, b: int(a < b),
    "le": lambda a, b: int(a <= b),
    "gt": lambda a, b: int(a > b),
    "ge": lambda a, b: int(a >= b),
    "not": lambda a: 1 - a,
    "and": lambda a, b: a & b,
    "or": lambda a, b: a | b,
    "xor": lambda a, b: a ^ b,
}

_MODULAR = frozenset({"add", "sub", "mul", "neg"})
"""The lowest 128 bits of the result follow from those of the arguments, with a sign or without."""
_LOGICAL = frozenset({"eq", "ne", "lt", "le", "gt", "ge", "not", "and", "or", "xor"})


def _corners(name: str, ranges: list[Interval]) -> Interval:
    """The exact interval of an operation over intervals (Moore, Interval Analysis, 1966)."""
    if name in ("neg", "abs"):
        ((low, high),) = ranges
        if name == "neg":
            return -high, -low
        return (0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))
    (a, b), (c, d) = ranges
    if name == "mod":
        size = max(abs(c), abs(d), 1) - 1
        reach = min(size, max(abs(a), abs(b)))
        return (-reach if a < 0 else 0), (reach if b > 0 else 0)
    if name == "div":
        divisors = [x for x in (c, d, -1, 1) if x != 0 and c <= x <= d]
        if not divisors:
            return 0, 0
    else:
        divisors = [c, d]
    if name == "add":
        return a + c, b + d
    if name == "sub":
        return a - d, b - c
    results = [FOLD[name](x, y) for x in (a, b) for y in divisors]
    return min(results), max(results)


def exact(name: OpName, *args: Expr) -> Expr:
    """`op`, for the lowering. Raises TooWideError where bounded arguments give a result that may leave 128 bits."""
    made = op(name, *args)
    if isinstance(made.type, Unbounded) and None not in map(interval, args):
        raise TooWideError(name)
    return made


def op(name: OpName, *args: Expr) -> Expr:
    """The operation with its exact type; folded when every argument is a constant."""
    if name in ("and", "or"):
        return _logic(name, *args)
    if name == "not" and isinstance(args[0], _Op) and args[0].op == "not":
        return args[0].args[0]
    constants = [a.value for a in args if isinstance(a, Const)]
    if len(constants) == len(args) and not (name in ("div", "mod") and constants[1] == 0):
        value = FOLD[name](*constants)
        if name in _LOGICAL:
            return Const(value, BOOL)
        if fits(value, value) and fits(min(value, *constants), max(value, *constants)):
            return const(value)
    return applied(name, *args)


def applied(name: OpName, *args: Expr) -> Expr:
    """The operation with its exact type, whatever its arguments are."""
    if name in _LOGICAL:
        return _Op(name, args, BOOL)
    ranges: list[Interval] = []
    for a in args:
        bounds = interval(a)
        if bounds is None:
            return _Op(name, args, UNBOUNDED)
        ranges.append(bounds)
    low, high = found = _corners(name, ranges)
    if name not in _MODULAR:
        low, high = min(low, *(r[0] for r in ranges)), max(high, *(r[1] for r in ranges))
    return _Op(name, args, Int(*found) if fits(low, high) else UNBOUNDED)


def _logic(name: OpName, a: Expr, b: Expr) -> Expr:
    neutral, absorbing = (1, 0) if name == "and" else (0, 1)
    for x, y in ((a, b), (b, a)):
        if isinstance(x, Const):
            return y if x.value == neutral else Const(absorbing, BOOL)
    return _Op(name, (a, b), BOOL)


def conjunction(args: list[Expr]) -> Expr:
    result: Expr = TRUE
    for a in args:
        result = op("and", result, a)
    return result


def disjunction(args: list[Expr]) -> Expr:
    result: Expr = FALSE
    for a in args:
        result = op("or", result, a)
    return result


def ite(condition: Expr, then: Expr, otherwise: Expr) -> Expr:
    if isinstance(condition, Const):
        return then if condition.value else otherwise
    return Ite(condition, then, otherwise, join(then.type, otherwise.type))


def join(a: Type, b: Type) -> Type:
    """The smallest type that holds the values of both."""
    if isinstance(a, Int) and isinstance(b, Int):
        if a.boolean and b.boolean:
            return BOOL
        low, high = min(a.low, b.low), max(a.high, b.high)
        if fits(low, high):
            return Int(low, high)
    return UNBOUNDED


def found(number: Expr, values: Sequence[Expr]) -> Expr:
    """``values[number]``, by halving; one of the ends where there is none."""
    return searched(number, list(enumerate(values)))


def searched(key: Expr, values: Sequence[tuple[int, Expr]]) -> Expr:
    """The value of a key, by halving; the keys are in ascending order."""
    if all(value == values[0][1] for _, value in values):
        return values[0][1]
    middle = len(values) // 2
    return ite(op("lt", key, const(values[middle][0])), searched(key, values[:middle]), searched(key, values[middle:]))


def may_overflow(e: Expr) -> bool:
    """Evaluating `e` can leave 64 bits, so it must not be evaluated where the language does not."""
    stack = [e]
    while stack:
        node = stack.pop()
        if isinstance(node, _Op):
            if isinstance(node.type, Unbounded):
                return True
            stack.extend(node.args)
        elif isinstance(node, Ite):
            stack += [node.condition, node.then, node.otherwise]
        elif isinstance(node, Get) and node.index is not None:
            stack.append(node.index)
    return False


def wrapped(e: Expr, into: Int) -> Expr:
    """`e` stored into a fixed-width type: unchanged when it fits, else modulo its size."""
    bounds = interval(e)
    if bounds is not None and into.low <= bounds[0] and bounds[1] <= into.high:
        return e
    if isinstance(e, Const):
        return const(wrap(e.value, into.low, into.high))
    return _Op("wrap", (e,), into)
