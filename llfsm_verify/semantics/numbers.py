"""Numbers, lowered: a decimal is a whole number of steps of ``10 ** -digits``, and what is calculated is aligned first.

The digits of every expression follow from its type (docs/semantics.md, Decimals), so all of this is integer arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isqrt
from typing import cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.language.typed import Binary, Conditional, Unary
from llfsm_verify.language.types import FixedType, digits_of
from llfsm_verify.program.program import Expr, OpName, Unbounded
from llfsm_verify.program.terms import TooWideError, const, exact, interval, ite
from llfsm_verify.semantics.bits import complement

_ALIGNED = frozenset(("add", "sub", "min", "max", "eq", "ne", "lt", "le", "gt", "ge"))


def rescaled(value: Expr, digits: int, to: int) -> Expr:
    """The same number in other steps, truncated towards zero where the new steps are larger."""
    if to > digits:
        return exact("mul", value, const(10 ** (to - digits)))
    return exact("div", value, const(10 ** (digits - to))) if to < digits else value


def arithmetic(name: OpName, left: Expr, left_digits: int, right: Expr, right_digits: int) -> tuple[Expr, int]:
    """An operation of two numbers, and the digits of its result. The divisor is not zero."""
    if name in _ALIGNED:
        digits = max(left_digits, right_digits)
        return exact(name, rescaled(left, left_digits, digits), rescaled(right, right_digits, digits)), digits
    if name == "mul":
        return exact(name, left, right), left_digits + right_digits
    if name == "div":
        return exact(name, rescaled(left, 0, right_digits), right), left_digits
    return exact(name, left, right), left_digits


def binary(e: Binary, left: Expr, right: Expr) -> Expr:
    """An operation on values of its sides, which are evaluated already."""
    if e.op in ("band", "bor", "bxor", "shl", "shr"):
        raise AssertionError("bit operations have statements of their own")
    name = cast(OpName, e.op)
    return arithmetic(name, left, digits_of(e.left.type), right, digits_of(e.right.type))[0]


def sides(e: Conditional, then: Expr, otherwise: Expr) -> tuple[Expr, Expr]:
    """The values of both sides of a conditional in the steps of its type."""
    digits = digits_of(e.type)
    return (
        rescaled(then, digits_of(e.then.type), digits),
        rescaled(otherwise, digits_of(e.otherwise.type), digits),
    )


def unary(e: Unary, value: Expr) -> Expr:
    """`neg`, `abs`, `not`, `floor`, `ceil` or `round` of a value; what is rounded is read twice."""
    step = 10 ** digits_of(e.operand.type)
    if e.op == "floor":
        return exact(
            "sub", exact("div", value, const(step)), _one_where(exact("lt", exact("mod", value, const(step)), const(0)))
        )
    if e.op == "ceil":
        return exact(
            "add", exact("div", value, const(step)), _one_where(exact("gt", exact("mod", value, const(step)), const(0)))
        )
    if e.op == "round":
        half = ite(exact("lt", value, const(0)), const(-(step // 2)), const(step // 2))
        return exact("div", exact("add", value, half), const(step))
    if e.op == "sqrt":
        raise AssertionError("a square root has statements of its own")
    if e.op == "bnot":
        assert isinstance(e.type, FixedType)
        return complement(e.type, value)
    return exact(e.op, value)


def choose(condition: Expr, then: Expr, otherwise: Expr) -> Expr:
    """One of two values. Raises TooWideError where no 128 bits hold both."""
    made = ite(condition, then, otherwise)
    if isinstance(made.type, Unbounded) and None not in (interval(then), interval(otherwise)):
        raise TooWideError("ite")
    return made


def too_wide(span: Span) -> DiagnosticError:
    """What is said of an expression whose lowering raises TooWideError."""
    message = "what is calculated here may leave 128 bits"
    hint = "give what is read here smaller types, or keep a part of it in a variable"
    return DiagnosticError(Diagnostic("E193", message, span, hint=hint))


def _one_where(condition: Expr) -> Expr:
    return ite(condition, const(1), const(0))


def square_root(value: Expr, digits: int, let: Callable[[Expr], Expr], span: Span) -> Expr:
    """The largest number of steps whose square does not exceed a value that is not negative, found bit by bit.

    `let` keeps a value in a local. Raises DiagnosticError (E163) for a value without bounds.
    """
    squared = let(rescaled(value, digits, 2 * digits))
    bounds = interval(squared)
    if bounds is None:
        message = "nothing bounds this number, so nothing bounds its root"
        raise DiagnosticError(Diagnostic("E163", message, span, hint="give what is read here a range"))
    largest = isqrt(max(bounds[1], 0))
    root: Expr = const(0)
    for bit in reversed(range(largest.bit_length())):
        tried = let(exact("add", root, const(1 << bit)))
        root = let(ite(exact("le", tried, exact("div", squared, tried)), tried, root))
    return root
