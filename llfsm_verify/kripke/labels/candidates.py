"""Representatives that are expressions: the ends of the intervals that comparisons with variables cut an input into."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.program.labelling import clamp
from llfsm_verify.program.outcomes import PREFIX
from llfsm_verify.program.program import Choice, Const, Expr, Get, Local, Op, Unbounded
from llfsm_verify.program.terms import const, interval, op
from llfsm_verify.program.trees import distinct_nodes, nodes

MOST = 16
"""Candidates for the representatives of one input."""
_COMPARISONS = ("eq", "ne", "lt", "le", "gt", "ge")


def candidates(choice: Choice, asked: Sequence[Expr], fixed: Sequence[int]) -> tuple[Expr, ...] | None:
    """Values at which the outcome may change: `fixed` ones, and those that terms with variables suggest.

    That they are enough is for the solver to prove. None: the terms suggest none, or too many.
    """
    found: dict[Expr, None] = dict.fromkeys(map(const, fixed))
    for term in asked:
        if any(isinstance(n, Get) for n in nodes(term)):
            around = _of_term(choice, term)
            if around is None:
                return None
            found |= dict.fromkeys(around)
    found |= {const(choice.type.low): None}
    return tuple(found) if len(found) <= MOST else None


def suggest(choice: Choice, asked: Sequence[Expr]) -> tuple[Expr, ...]:
    """Values at which terms without variables may change; other terms suggest nothing."""
    found: dict[Expr, None] = {const(choice.type.low): None}
    for term in asked:
        for part in distinct_nodes(term):
            found |= dict.fromkeys(_of_term(choice, part) or ())
    return tuple(found)


def _of_term(choice: Choice, term: Expr) -> tuple[Expr, ...] | None:
    """Where a comparison with a side that is linear in the choice may change."""
    local = PREFIX + choice.name
    if not isinstance(term, Op) or term.op not in _COMPARISONS or not _mentions(term, local):
        return None
    left, right = term.args
    if _mentions(right, local):
        left, right = right, left
    if _mentions(right, local):
        return None
    bound = _isolated(left, right, local)
    if bound is None:
        return None
    found = tuple(clamp(e, choice.type) for e in _around(*bound))
    return None if any(isinstance(e.type, Unbounded) for e in found) else found


def _mentions(e: Expr, local: str) -> bool:
    return any(isinstance(n, Local) and n.name == local for n in distinct_nodes(e))


def _isolated(side: Expr, other: Expr, local: str) -> tuple[Expr, bool] | None:
    """What the local is compared with when a side that is linear in it is compared with `other`; and whether that is
    rounded."""
    rounded = False
    while not isinstance(side, Local):
        if not isinstance(side, Op):
            return None
        inner = [a for a in side.args if _mentions(a, local)]
        if len(inner) != 1:
            return None
        first = inner[0] is side.args[0]
        if side.op == "add":
            other = op("sub", other, side.args[1] if first else side.args[0])
        elif side.op == "sub":
            other = op("add", other, side.args[1]) if first else op("sub", side.args[0], other)
        elif side.op == "neg":
            other = op("neg", other)
        elif side.op == "mul":
            factor = side.args[1] if first else side.args[0]
            if not isinstance(factor, Const) or factor.value == 0:
                return None
            other, rounded = op("div", other, factor), True
        else:
            return None
        if isinstance(other.type, Unbounded) or interval(other) is None:
            return None
        side = inner[0]
    return other, rounded


def _around(bound: Expr, rounded: bool) -> Iterator[Expr]:
    if rounded:
        yield op("sub", bound, const(1))
    yield bound
    yield op("add", bound, const(1))
