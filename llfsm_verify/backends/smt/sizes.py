"""How many bits the numbers of a step can have: a solver computes exactly, and a number squared again and again is soon
larger than any time or memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from llfsm_verify.program.program import Const, Expr, Get, Int, Ite, Local, Op, Type, Unbounded
from llfsm_verify.program.symbolic import Key
from llfsm_verify.program.trees import fold, nodes

MAX_BITS = 10_000
"""Larger numbers are given to no solver. Python reads up to 4,300 digits, about 14,000 bits, from a model."""
ANY_BITS = 64
"""What is assumed of an `int` about which nothing is known."""


class NumberTooLarge(MemoryError):
    """A value may have more than `MAX_BITS` bits."""

    def __init__(self) -> None:
        super().__init__(f"a value of type int may have more than {MAX_BITS:,} bits, and no solver is asked about it")


def multiplies(expressions: Iterable[Expr]) -> bool:
    """Some product has no bounds: without one, numbers grow by a bit for each operation at most."""
    return any(
        isinstance(node, Op) and node.op == "mul" and isinstance(node.type, Unbounded)
        for e in expressions
        for node in nodes(e)
    )


def size_of(root: Expr, before: Mapping[Key, int], locals_: Mapping[str, int]) -> int:
    """The bits that suffice for the value of an expression; `before` and `locals_` are those of what it reads, where
    the type does not tell. Raises NumberTooLarge for it and for every value on the way."""

    def visit(node: Expr, args: list[int]) -> int:
        match node:
            case Const(value, _):
                return value.bit_length()
            case Get(name, index, kind):
                bits = _element(before, name, index)
            case Local(name, kind):
                bits = locals_.get(name, ANY_BITS)
            case Ite(_, _, _, kind):
                bits = max(args[1], args[2])
            case Op(op, _, kind):
                bits = _operated(op, args)
        bits = _limited(bits, kind)
        if bits > MAX_BITS:
            raise NumberTooLarge
        return bits

    return fold(root, visit)


def _element(before: Mapping[Key, int], name: str, index: Expr | None) -> int:
    if index is None or isinstance(index, Const):
        return before.get((name, None if index is None else index.value), ANY_BITS)
    return max((bits for key, bits in before.items() if key[0] == name), default=ANY_BITS)


def _operated(op: str, args: list[int]) -> int:
    match op:
        case "add" | "sub":
            return max(args) + 1
        case "mul":
            return sum(args)
        case "div":
            return args[0]
        case "mod":
            return min(args)
    return max(args)


def _limited(bits: int, kind: Type) -> int:
    return min(bits, max(kind.low.bit_length(), kind.high.bit_length())) if isinstance(kind, Int) else bits
