"""What typed guards and actions contain: commands, clock bounds and reads of inputs."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import floor

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import (
    After,
    Binary,
    Command,
    Conditional,
    Expression,
    Field,
    Index,
    Literal,
    Read,
    Unary,
)
from llfsm_verify.language.types import digits_of
from llfsm_verify.program.program import BOOL, Const, Expr, Get
from llfsm_verify.program.terms import TooWideError, const, interval, ite, op
from llfsm_verify.semantics.numbers import binary, sides, square_root, too_wide, unary
from llfsm_verify.semantics.storage import element_names, machine_type

MAX_TICKS = 1 << 20


def input_reads(root: object, inputs: frozenset[str]) -> list[Read]:
    """Reads of the whiteboard variables named in `inputs`."""
    return [r for r in of_kind(root, Read) if r.variable.name in inputs]


def elements(read: Read) -> list[str]:
    """The scalars that a read whose indices are constants has, by their full names (``a[1].x``)."""
    name, kind = read.variable.name, read.variable.type
    for step in read.path:
        if isinstance(step, Field):
            assert isinstance(kind, lt.RecordType)
            name, kind = f"{name}.{step.name}", kind.fields[step.index][1]
        else:
            assert isinstance(kind, lt.ArrayType)
            name, kind = f"{name}[{constant_index(step)}]", kind.element
    return [n for n, _ in element_names(name, kind)]


def constant_index(step: Index) -> int:
    """The index that a step of a property's path says."""
    value = step.value
    sign = 1
    while isinstance(value, Unary) and value.op == "neg":
        sign, value = -sign, value.operand
    assert isinstance(value, Literal), "the atom checker allows constant indices only"
    return sign * int(value.value)


@dataclass(frozen=True, slots=True)
class Survey:
    """What guards and actions contain that decides which control variables there are."""

    commands: tuple[Command, ...]
    bounds: tuple[Bound, ...]


def survey(root: object) -> Survey:
    """The commands and the bounds of `after` in some guards and actions, in order."""
    found = [n for n in nodes(root) if isinstance(n, (Command, After))]
    return Survey(
        tuple(n for n in found if isinstance(n, Command)), tuple(_bound(n) for n in found if isinstance(n, After))
    )


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
                    f"this time is {ticks:,} cycles of {cycle_ms} ms, more than {MAX_TICKS:,}",
                    self.span,
                    hint="use a longer cycle_ms, or a type with a smaller largest value",
                )
            )
        return ticks


def _bound(after: After) -> Bound:
    if isinstance(after.bound, Fraction):
        return Bound(after.bound, after.bound, after.span)
    return Bound(None, Fraction(_largest(after) * after.scale), after.span)


def _largest(after: After) -> int:
    bound = after.bound
    assert not isinstance(bound, Fraction)
    try:
        values = interval(_shape(bound))
    except TooWideError:
        raise too_wide(after.span) from None
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
    if isinstance(e, Unary) and e.op == "sqrt":
        return square_root(op("max", _shape(e.operand), const(0)), digits_of(e.operand.type), _any_of, e.span)
    if isinstance(e, Unary) and e.op != "not":
        return unary(e, _any_of(_shape(e.operand)))
    if isinstance(e, Binary) and e.op in ("add", "sub", "mul", "div", "mod", "min", "max"):
        return binary(e, _shape(e.left), _shape(e.right))
    if isinstance(e, Conditional):
        return ite(Get("", None, BOOL), *sides(e, _shape(e.then), _shape(e.otherwise)))
    assert not isinstance(e.type, (lt.ArrayType, lt.RecordType))
    return Get("", None, machine_type(e.type))


def _any_of(e: Expr) -> Expr:
    """A variable that has the values of `e`: what is read twice is written once."""
    return e if isinstance(e, Const) else Get("", None, e.type)
