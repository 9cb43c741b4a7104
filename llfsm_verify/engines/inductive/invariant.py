"""Inductive invariants: formulas over the scalars of a state, and how they are read from terms of a solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import z3

from llfsm_verify.engines.inductive.observers import Target
from llfsm_verify.program.program import UNBOUNDED, Const, Expr, Int, OpName, Unbounded
from llfsm_verify.program.terms import FALSE, TRUE, conjunction, const, disjunction, is_wide, ite, op
from llfsm_verify.program.trees import nodes


class Unreadable(Exception):
    """A solver's term has something that step programs have not."""


@dataclass(frozen=True, slots=True)
class Invariant:
    """What proves that `target` is never reached.

    `formula` holds in the beginning and after every unit of steps that is not bad (units as `System` has them). Where
    it holds, no unit is bad that comes after `k` that are not, through k + 1 states that all differ (with k = 0 no
    unit at all). And the first k units of a run are not bad.
    """

    target: Target
    formula: Expr
    k: int = 0

    @property
    def conjuncts(self) -> tuple[Expr, ...]:
        """What `formula` is the conjunction of; none where it is true."""
        return tuple(_conjuncts(self.formula))

    @property
    def is_bounded(self) -> bool:
        """Every number in the formula has bounds inside 64 bits."""
        return not any(isinstance(n.type, Unbounded) for n in nodes(self.formula))


def _conjuncts(formula: Expr) -> list[Expr]:
    from llfsm_verify.program.program import Op

    found: list[Expr] = []
    stack = [formula]
    while stack:
        match stack.pop():
            case Op("and", args, _):
                stack.extend(reversed(args))
            case Const(1, _):
                pass
            case other:
                found.append(other)
    return found


def read(term: z3.ExprRef, names: Mapping[int, Expr]) -> Expr:
    """A term over mathematical integers as an expression; `names` says by `get_id` what its constants are.

    Raises Unreadable.
    """
    done: dict[int, Expr] = {}
    stack: list[tuple[z3.ExprRef, bool]] = [(term, False)]
    while stack:
        node, ready = stack.pop()
        key = node.get_id()
        if key in done:
            continue
        if not z3.is_app(node):
            raise Unreadable("it has a quantifier")
        if key in names:
            done[key] = names[key]
        elif ready or not node.num_args():
            done[key] = _made(node, [done[c.get_id()] for c in node.children()])
        else:
            stack.append((node, True))
            stack.extend((c, False) for c in node.children())
    return done[term.get_id()]


def _made(node: z3.ExprRef, args: list[Expr]) -> Expr:
    if z3.is_int_value(node):
        value = int(node.as_long())
        return Const(value, UNBOUNDED) if is_wide(Int(value, value)) else const(value)
    make = _OPERATIONS.get(node.decl().kind())
    if make is None:
        raise Unreadable(f"it has `{node.decl().name()}`")
    return make(args)


def _chain(name: OpName) -> Callable[[Sequence[Expr]], Expr]:
    return lambda args: reduce(lambda a, b: op(name, a, b), args)


def _distinct(args: Sequence[Expr]) -> Expr:
    pairs = [op("eq", a, b) for i, a in enumerate(args) for b in args[:i]]
    return op("not", disjunction(pairs))


def _remainder(args: Sequence[Expr]) -> Expr:
    """Z3's, which is never negative; by a positive constant."""
    rest = op("mod", args[0], _positive(args[1]))
    return ite(op("lt", rest, const(0)), op("add", rest, args[1]), rest)


def _quotient(args: Sequence[Expr]) -> Expr:
    return op("div", op("sub", args[0], _remainder(args)), _positive(args[1]))


def _positive(e: Expr) -> Expr:
    if isinstance(e, Const) and e.value > 0:
        return e
    raise Unreadable("it divides by something that is not a positive constant")


def _implies(args: Sequence[Expr]) -> Expr:
    return op("or", op("not", args[0]), args[1])


_OPERATIONS: Mapping[int, Callable[[Sequence[Expr]], Expr]] = {
    z3.Z3_OP_TRUE: lambda _: TRUE,
    z3.Z3_OP_FALSE: lambda _: FALSE,
    z3.Z3_OP_AND: lambda args: conjunction(list(args)),
    z3.Z3_OP_OR: lambda args: disjunction(list(args)),
    z3.Z3_OP_NOT: lambda args: op("not", args[0]),
    z3.Z3_OP_XOR: _chain("xor"),
    z3.Z3_OP_IMPLIES: _implies,
    z3.Z3_OP_EQ: lambda args: op("eq", args[0], args[1]),
    z3.Z3_OP_IFF: lambda args: op("eq", args[0], args[1]),
    z3.Z3_OP_DISTINCT: _distinct,
    z3.Z3_OP_ITE: lambda args: ite(args[0], args[1], args[2]),
    z3.Z3_OP_LE: lambda args: op("le", args[0], args[1]),
    z3.Z3_OP_LT: lambda args: op("lt", args[0], args[1]),
    z3.Z3_OP_GE: lambda args: op("ge", args[0], args[1]),
    z3.Z3_OP_GT: lambda args: op("gt", args[0], args[1]),
    z3.Z3_OP_ADD: _chain("add"),
    z3.Z3_OP_SUB: _chain("sub"),
    z3.Z3_OP_MUL: _chain("mul"),
    z3.Z3_OP_UMINUS: lambda args: op("neg", args[0]),
    z3.Z3_OP_MOD: _remainder,
    z3.Z3_OP_IDIV: _quotient,
}
