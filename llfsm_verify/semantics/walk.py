"""Walks over typed guards and actions: which commands, clock bounds and input reads they contain."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from fractions import Fraction
from math import floor
from typing import TypeVar

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.typed import After, Binary, Command, Conditional, Expression, Literal, Read, Unary
from llfsm_verify.semantics.program import BOOL, Expr, Get
from llfsm_verify.semantics.terms import const, interval, ite, machine_type, op

T = TypeVar("T")
MAX_TICKS = 1 << 20


def nodes(root: object) -> Iterator[object]:
    """Every node of the typed trees in `root` (a node, or tuples of nodes), without recursion."""
    stack = [root]
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack.extend(reversed(node))
        elif is_dataclass(node) and not isinstance(node, (Span, type)):
            yield node
            stack.extend(getattr(node, f.name) for f in reversed(fields(node)) if f.name not in ("span", "type"))


def of_kind(root: object, kind: type[T]) -> Iterator[T]:
    return (n for n in nodes(root) if isinstance(n, kind))


def commands(root: object) -> list[Command]:
    return list(of_kind(root, Command))


def input_reads(root: object, inputs: frozenset[str]) -> list[Read]:
    """Reads of the whiteboard variables named in `inputs`."""
    return [r for r in of_kind(root, Read) if r.variable.name in inputs]


@dataclass(frozen=True, slots=True)
class Bound:
    """The bound of one `after`: a constant in ms, or the largest value of an expression."""

    constant: Fraction | None
    largest: Fraction
    span: Span

    def ticks(self, cycle_ms: Fraction | None) -> int:
        """The last tick at which `after` does not hold yet; a bound above 2^20 ticks is an error that names it."""
        assert cycle_ms is not None
        ticks = floor(self.largest / cycle_ms)
        if ticks > MAX_TICKS:
            raise DiagnosticError(
                Diagnostic(
                    "E190",
                    f"this time is {ticks} cycles of {cycle_ms} ms, more than {MAX_TICKS}",
                    self.span,
                    hint="use a longer cycle_ms, or a type with a smaller largest value",
                )
            )
        return ticks


def after_bounds(root: object) -> list[Bound]:
    result = []
    for after in of_kind(root, After):
        if isinstance(after.bound, Fraction):
            result.append(Bound(after.bound, after.bound, after.span))
        else:
            result.append(Bound(None, Fraction(_largest(after) * after.scale), after.span))
    return result


def _largest(after: After) -> int:
    bound = after.bound
    assert not isinstance(bound, Fraction)
    values = interval(_shape(bound))
    if values is not None:
        return values[1]
    raise DiagnosticError(
        Diagnostic(
            "E191",
            "nothing bounds this time, so its clock would never stop",
            after.span,
            hint="use a constant, or variables of bounded types such as 0..60",
        )
    )


def _shape(e: Expression) -> Expr:
    """A step-program expression with the interval of `e` (nobody evaluates it)."""
    if isinstance(e, Literal):
        return const(int(e.value))
    if isinstance(e, Unary) and e.op != "not":
        return op(e.op, _shape(e.operand))
    if isinstance(e, Binary) and e.op in ("add", "sub", "mul", "div", "mod", "min", "max"):
        return op(e.op, _shape(e.left), _shape(e.right))
    if isinstance(e, Conditional):
        return ite(Get("", None, BOOL), _shape(e.then), _shape(e.otherwise))
    assert not isinstance(e.type, (lt.ArrayType, lt.RecordType))
    return Get("", None, machine_type(e.type))
