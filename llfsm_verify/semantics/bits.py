"""Bit operations, lowered to arithmetic: step programs have integers only (docs/semantics.md, Bits).

Nothing after the lowering knows of bits, and machine code gets its instructions back from the compiler: a division by a
power of two is a shift there, and a remainder a mask.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from llfsm_verify.language.types import FixedType
from llfsm_verify.program.program import Const, Expr, Int, Ite, Op
from llfsm_verify.program.terms import const, ite, op, wrapped

Let = Callable[[Expr], Expr]
"""Keeps a value in a local."""


def complement(kind: FixedType, value: Expr) -> Expr:
    """``~value``."""
    return op("sub", const(kind.low + kind.high), value)


def bitwise(name: str, kind: FixedType, left: Expr, right: Expr, let: Let) -> Expr:
    """`band`, `bor` or `bxor` of two numbers of the type."""
    u, v = let(_unsigned(kind, left)), let(_unsigned(kind, right))
    common = _common(kind, u, v)
    if name != "band":
        common = let(common)
        both = op("add", u, v)
        common = op("sub", both, common if name == "bor" else op("mul", const(2), common))
    return wrapped(common, Int(kind.low, kind.high))


def shifted(name: str, kind: FixedType, value: Expr, count: Expr, let: Let) -> Expr:
    """`shl` or `shr` by a count from 0 to the width less one."""
    factor: Expr = const(1 << (kind.bits - 1))
    for bit in reversed(range(kind.bits - 1)):
        factor = ite(op("eq", count, const(bit)), const(1 << bit), factor)
    factor = let(factor)
    if name == "shl":
        return wrapped(op("mul", value, factor), Int(kind.low, kind.high))
    if not kind.signed:
        return op("div", value, factor)
    value = let(value)
    below = op("sub", value, op("sub", factor, const(1)))  # a quotient is truncated towards zero, a shift is not
    return wrapped(op("div", ite(op("lt", value, const(0)), below, value), factor), Int(kind.low, kind.high))


def _unsigned(kind: FixedType, value: Expr) -> Expr:
    """The number that has the same bits and no sign."""
    return wrapped(value, Int(0, (1 << kind.bits) - 1))


def _common(kind: FixedType, u: Expr, v: Expr) -> Expr:
    """The bits that two numbers without a sign have in common."""
    if isinstance(u, Const):
        u, v = v, u
    if isinstance(v, Const):
        return _sum(_run(kind, u, low, length) for low, length in _runs(v.value))
    return _sum(_bit(u, v, number) for number in range(kind.bits))


def _bit(u: Expr, v: Expr, number: int) -> Expr:
    ones = [op("eq", op("mod", op("div", x, const(1 << number)), const(2)), const(1)) for x in (u, v)]
    return ite(op("and", *ones), const(1 << number), const(0))


def common_bits(e: Expr) -> tuple[Expr, Expr] | None:
    """The two numbers of which an expression is the common bits, where `bitwise` made it; else None."""
    rest, lowest, count = e, e, 0
    while isinstance(rest, Op) and rest.op == "add" and len(rest.args) == 2 and isinstance(rest.args[1], Ite):
        rest, lowest = rest.args
        count += 1
    if count < 8 or not isinstance(lowest, Ite) or not isinstance(lowest.condition, Op):
        return None
    found: list[Expr] = []
    for part in lowest.condition.args:  # eq(mod(div(number, 1), 2), 1)
        for _ in range(3):
            if not isinstance(part, Op):
                return None
            part = part.args[0]
        found.append(part)
    if len(found) != 2 or e != _sum(_bit(found[0], found[1], number) for number in range(count)):
        return None
    return found[0], found[1]


def _runs(mask: int) -> Iterator[tuple[int, int]]:
    """The runs of ones in a mask: the lowest bit of each, and its length."""
    low = 0
    while mask >> low:
        length = 0
        while mask >> (low + length) & 1:
            length += 1
        if length:
            yield low, length
        low += length + 1


def _run(kind: FixedType, u: Expr, low: int, length: int) -> Expr:
    part = op("div", u, const(1 << low)) if low else u
    if low + length < kind.bits:
        part = op("mod", part, const(1 << length))
    return op("mul", part, const(1 << low)) if low else part


def _sum(terms: Iterator[Expr]) -> Expr:
    total: Expr = const(0)
    for term in terms:
        total = op("add", total, term)
    return total
