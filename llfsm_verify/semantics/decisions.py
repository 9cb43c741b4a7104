"""Decisions, told condition by condition: each guard, `if` and `?:` of which a step evaluates the conditions.

A decision is what is asked there as a whole (CAST-10, 2002); its conditions are the leaves of its `not`, `&&`, `||`,
and of `==` and `!=` between Boolean values. A condition is told when it decides: changing it alone would change the
outcome, given the values of the others, where one that is not evaluated (after `&&` and `||`) may have any value. In
two evaluations in which a condition decides, with different values of it and the same ones of what a `==` or `!=`
around it compares, the outcomes differ, and so does each operator between: they are an independence pair of masking
MC/DC (J. J. Chilenski, An Investigation of Three Forms of the MC/DC Criterion, DOT/FAA/AR-01/18, 2001; CAST-6, 2001;
J. J. Chilenski and S. P. Miller, Applicability of modified condition/decision coverage to software testing, Software
Engineering Journal 9(5), 1994).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

from llfsm_verify.language import types as lt
from llfsm_verify.language.typed import Binary, Expression, Literal, Unary
from llfsm_verify.program.program import BOOL, Block, Expr, If, Let, Local, Stmt, Type
from llfsm_verify.program.terms import FALSE, TRUE, op
from llfsm_verify.semantics.parts import written
from llfsm_verify.semantics.probes import Condition, Probe, Probes, deciding

MOST_COMPARED = 6
"""Comparisons of Boolean values around one condition, beyond which it is not told."""


class Lowers(Protocol):
    """What of `expressions.Code` lowers a decision."""

    out: list[Stmt]

    def expr(self, e: Expression, /) -> Expr: ...
    def let(self, value: Expr, /) -> Expr: ...
    def temporary(self, kind: Type, /) -> Local: ...


@dataclass(frozen=True, slots=True)
class _Above:
    """An operator above a condition: what it is, the other side, and whether the condition is on its left."""

    op: str
    other: Expression
    own: Expression
    left: bool


def decided(code: Lowers, e: Expression, probe: Probe, probes: Probes) -> Expr:
    """Lower a decision, with statements that tell of each of its conditions where it decides."""
    tree = _apart(e)
    leaves = list(_leaves(tree, ()))
    probes.conditions[probe] = tuple(
        Condition(leaf.span, written(leaf), 0 if _compared(above) > MOST_COMPARED else 1 << _compared(above))
        for leaf, above in leaves
    )
    if len(leaves) < 2:
        return code.let(code.expr(e))
    nodes = {id(node): node for leaf, above in leaves for node in (leaf, *(n for a in above for n in (a.own, a.other)))}
    marks: dict[int, Local] = {key: code.temporary(BOOL) for key in nodes}
    code.out += [Let(mark, FALSE) for mark in marks.values()]
    probes.marks |= marks
    value = code.let(code.expr(tree))
    for key in marks:
        del probes.marks[key]
    for number, (leaf, above) in enumerate(leaves):
        if _compared(above) <= MOST_COMPARED:
            code.out += _told(probes, probe, number, marks[id(leaf)], above, marks)
    return value


def _is_operator(e: Expression) -> bool:
    """Whether it makes a truth value of truth values."""
    if isinstance(e, Unary):
        return e.op == "not"
    return isinstance(e, Binary) and e.op in ("and", "or", "xor", "eq", "ne") and isinstance(e.left.type, lt.BoolType)


def _apart(e: Expression) -> Expression:
    """The same decision, each node of which is an object of its own."""
    if not _is_operator(e):
        return replace(e)
    if isinstance(e, Unary):
        return replace(e, operand=_apart(e.operand))
    assert isinstance(e, Binary)
    return replace(e, left=_apart(e.left), right=_apart(e.right))


def _leaves(e: Expression, above: tuple[_Above, ...]) -> Iterator[tuple[Expression, tuple[_Above, ...]]]:
    """The conditions in the order of the text, each with the operators of two sides above it."""
    if not _is_operator(e):
        if not isinstance(e, Literal):
            yield e, above
    elif isinstance(e, Unary):
        yield from _leaves(e.operand, above)
    else:
        assert isinstance(e, Binary)
        yield from _leaves(e.left, (*above, _Above(e.op, e.right, e.left, True)))
        yield from _leaves(e.right, (*above, _Above(e.op, e.left, e.right, False)))


def _compared(above: tuple[_Above, ...]) -> int:
    return sum(a.op not in ("and", "or") for a in above)


def _told(
    probes: Probes, probe: Probe, number: int, value: Expr, above: tuple[_Above, ...], marks: dict[int, Local]
) -> Block:
    """Tell the value of condition `number` if it decides, and in which situation."""
    decides: Expr = TRUE
    for a in (a for a in above if a.op in ("and", "or")):
        own, other = marks[id(a.own)], marks[id(a.other)]
        passes = other if a.op == "and" else op("not", other)
        if a.left:  # then the right side is not evaluated where the left one is enough
            passes = op("or", passes, op("not", own) if a.op == "and" else own)
        decides = passes if decides == TRUE else op("and", decides, passes)
    others = [marks[id(a.other)] for a in above if a.op not in ("and", "or")]

    def situation(place: int, so_far: int) -> Block:
        if place < len(others):
            return (If(others[place], situation(place + 1, so_far | 1 << place), situation(place + 1, so_far)),)
        return probes.watch(deciding(probe, number, so_far), value)

    return situation(0, 0) if decides == TRUE else (If(decides, situation(0, 0)),)
