"""Formulas changed in small ways: a conjunct dropped, a comparison flipped, a constant moved, variables swapped."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

from llfsm_verify.engines.inductive.observers import Scalar
from llfsm_verify.program.program import BOOL, Const, Expr, Get, Int, Local, Op
from llfsm_verify.program.terms import FALSE, TRUE, conjunction, op
from llfsm_verify.program.trees import fold

FLIPPED = {"eq": "ne", "ne": "eq", "lt": "ge", "ge": "lt", "le": "gt", "gt": "le"}
SHIFTED = {"lt": "le", "le": "lt", "gt": "ge", "ge": "gt"}


def corrupted(conjuncts: tuple[Expr, ...], scalars: tuple[Scalar, ...], seed: int) -> Iterator[Expr]:
    """Changed conjunctions without end."""
    random = Random(seed)
    while True:
        parts = list(conjuncts)
        for _ in range(random.choice((1, 1, 2, 3))):
            number = random.randrange(len(parts)) if parts else 0
            kind = random.randrange(6)
            if kind == 0 and parts:
                del parts[number]
            elif kind == 1:
                parts.append(op("not", literal(scalars, random)))
            elif kind == 2:
                parts.append(random.choice((FALSE, TRUE)))
            elif parts:
                parts[number] = changed(parts[number], scalars, random)
        yield conjunction(parts)


def literal(scalars: tuple[Scalar, ...], random: Random) -> Expr:
    scalar = random.choice(scalars)
    if scalar.type == BOOL:
        return scalar
    value = random.randint(scalar.type.low, scalar.type.high) if isinstance(scalar.type, Int) else random.randint(-3, 3)
    return op(random.choice(("eq", "le", "ge")), scalar, Const(value, Int(value, value)))


def changed(formula: Expr, scalars: tuple[Scalar, ...], random: Random) -> Expr:
    """One node of the formula is another one."""
    count = fold(formula, lambda _, args: 1 + sum(args))
    wanted, seen = random.randrange(count), 0

    def visit(node: Expr, args: list[Expr]) -> Expr:
        nonlocal seen
        seen += 1
        same: Expr = Op(node.op, tuple(args), node.type) if isinstance(node, Op) else node
        return other(same, scalars, random) if seen - 1 == wanted else same

    return fold(formula, visit)


def other(node: Expr, scalars: tuple[Scalar, ...], random: Random) -> Expr:
    match node:
        case Op(("eq" | "ne" | "lt" | "le" | "gt" | "ge") as name, args, kind):
            names = [FLIPPED[name], SHIFTED.get(name, FLIPPED[name])]
            return Op(random.choice(names), args, kind)
        case Op("and", args, kind):
            return Op("or", args, kind)
        case Op("or", args, kind):
            return random.choice((Op("and", args, kind), args[0], args[1]))
        case Op("not", args, _):
            return args[0]
        case Const(value, kind) if kind == BOOL:
            return Const(1 - value, BOOL)
        case Const(value, _):
            moved = value + random.choice((-2, -1, 1, 2))
            return Const(moved, Int(moved, moved))
        case Get() | Local():
            return random.choice([s for s in scalars if s.type == node.type])
    return op("not", node) if node.type == BOOL else node
