"""Values and operations of step programs as Z3 terms, in two theories: bit-vectors, and mathematical integers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import z3

from llfsm_verify.program.program import BOOL, Int, OpName, Type

OURS = ":"
"""Begins the names of unknowns that are not declared. No name that can be written has it: to the solver, one name is
one thing."""
COMPARISONS = ("eq", "ne", "lt", "le", "gt", "ge")


@dataclass(frozen=True, slots=True)
class Term:
    """A Z3 term with the step program's type of its value, which says how the term holds it: Booleans as Bool."""

    z3: z3.ExprRef
    type: Type


class Arithmetic(Protocol):
    """How numbers are held. Booleans are Bool in every theory."""

    name: str

    def constant(self, name: str, kind: Type) -> Term:
        """An unknown value; `within` says that it is one of its type."""
        ...

    def literal(self, value: int, kind: Type) -> Term: ...

    def within(self, term: Term) -> z3.BoolRef:
        """The value is one of its type (true where the theory has no others)."""
        ...

    def cast(self, term: Term, kind: Type) -> Term:
        """The same value, which is one of `kind`, held as one of it."""
        ...

    def number(self, op: OpName, args: Sequence[Term], kind: Type) -> Term:
        """An operation whose result is a number."""
        ...

    def compare(self, op: OpName, a: Term, b: Term) -> z3.BoolRef: ...

    def value(self, model: z3.ModelRef, term: Term) -> int:
        """The value that a model gives (a possible one, where the model leaves it open)."""
        ...


def is_bool(kind: Type) -> bool:
    return isinstance(kind, Int) and kind.boolean


def truth(arithmetic: Arithmetic, term: Term) -> z3.BoolRef:
    """A value that is 0 or 1 as a Bool."""
    if is_bool(term.type):
        return term.z3
    return arithmetic.compare("ne", term, arithmetic.literal(0, Int(0, 1)))


def operate(arithmetic: Arithmetic, op: OpName, args: Sequence[Term], kind: Type) -> Term:
    """`Op(op, args, kind)` of the step program."""
    if op in ("not", "and", "or", "xor"):
        bools = [truth(arithmetic, a) for a in args]
        made = {"not": z3.Not, "and": z3.And, "or": z3.Or, "xor": z3.Xor}[op](*bools)
        return arithmetic.cast(Term(made, BOOL), kind)
    if op in COMPARISONS:
        if op in ("eq", "ne") and all(is_bool(a.type) for a in args):
            equal = args[0].z3 == args[1].z3
            return Term(z3.Not(equal) if op == "ne" else equal, BOOL)
        a, b = (_numeric(arithmetic, x) for x in args)
        return Term(arithmetic.compare(op, a, b), BOOL)
    number = Int(0, 1) if is_bool(kind) else kind
    return arithmetic.cast(arithmetic.number(op, [_numeric(arithmetic, a) for a in args], number), kind)


def choose(arithmetic: Arithmetic, condition: Term, then: Term, otherwise: Term, kind: Type) -> Term:
    """`Ite(condition, then, otherwise, kind)`."""
    a, b = arithmetic.cast(then, kind), arithmetic.cast(otherwise, kind)
    return Term(z3.If(truth(arithmetic, condition), a.z3, b.z3), kind)


def _numeric(arithmetic: Arithmetic, term: Term) -> Term:
    return arithmetic.cast(term, Int(0, 1)) if is_bool(term.type) else term


class Integers:
    """Mathematical integers: no value is too large, and `after` many steps there may be more values than fit a word."""

    name = "integers"

    def constant(self, name: str, kind: Type) -> Term:
        return Term(z3.Bool(name) if is_bool(kind) else z3.Int(name), kind)

    def literal(self, value: int, kind: Type) -> Term:
        return Term(z3.BoolVal(bool(value)) if is_bool(kind) else z3.IntVal(value), kind)

    def within(self, term: Term) -> z3.BoolRef:
        kind = term.type
        if not isinstance(kind, Int) or kind.boolean:
            return z3.BoolVal(True)
        return z3.And(term.z3 >= kind.low, term.z3 <= kind.high)

    def cast(self, term: Term, kind: Type) -> Term:
        if is_bool(term.type) == is_bool(kind):
            return Term(term.z3, kind)
        return Term(term.z3 != 0 if is_bool(kind) else z3.If(term.z3, z3.IntVal(1), z3.IntVal(0)), kind)

    def number(self, op: OpName, args: Sequence[Term], kind: Type) -> Term:
        a = args[0].z3
        match op:
            case "add":
                made = a + args[1].z3
            case "sub":
                made = a - args[1].z3
            case "mul":
                made = a * args[1].z3
            case "neg":
                made = -a
            case "abs":
                made = z3.If(a < 0, -a, a)
            case "min" | "max":
                b = args[1].z3
                made = z3.If(a < b if op == "min" else a > b, a, b)
            case "div" | "mod":
                made = self._divided(op, a, args[1].z3)
            case "wrap":
                assert isinstance(kind, Int)
                size = kind.high - kind.low + 1
                made = (a - kind.low) % size + kind.low
            case _:
                raise AssertionError(op)
        return Term(made, kind)

    def _divided(self, op: str, a: z3.ArithRef, b: z3.ArithRef) -> z3.ArithRef:
        """Towards zero, as in C; Z3's own division leaves a remainder that is not negative."""
        size_a, size_b = z3.If(a < 0, -a, a), z3.If(b < 0, -b, b)
        if z3.is_int_value(b):
            size_b = z3.IntVal(abs(b.as_long()))
        if op == "mod":
            rest = size_a % size_b
            return z3.If(a < 0, -rest, rest)
        quotient = size_a / size_b
        return z3.If((a < 0) != (b < 0), -quotient, quotient)

    def compare(self, op: OpName, a: Term, b: Term) -> z3.BoolRef:
        x, y = a.z3, b.z3
        return {
            "eq": lambda: x == y,
            "ne": lambda: x != y,
            "lt": lambda: x < y,
            "le": lambda: x <= y,
            "gt": lambda: x > y,
            "ge": lambda: x >= y,
        }[op]()

    def value(self, model: z3.ModelRef, term: Term) -> int:
        found = model.eval(term.z3, model_completion=True)
        return int(z3.is_true(found)) if is_bool(term.type) else int(found.as_long())


class BitVectors:
    """Bit-vectors, as wide as the exact interval of each value asks for, signed where it has negative values.

    Programs with values of type Unbounded have none (`Int` types only).
    """

    name = "bit-vectors"

    def constant(self, name: str, kind: Type) -> Term:
        return Term(z3.Bool(name) if is_bool(kind) else z3.BitVec(name, width(kind)), kind)

    def literal(self, value: int, kind: Type) -> Term:
        return Term(z3.BoolVal(bool(value)) if is_bool(kind) else z3.BitVecVal(value, width(kind)), kind)

    def within(self, term: Term) -> z3.BoolRef:
        kind = term.type
        assert isinstance(kind, Int)
        if kind.boolean or kind.high - kind.low + 1 == 1 << width(kind):
            return z3.BoolVal(True)
        low, high = self.literal(kind.low, kind).z3, self.literal(kind.high, kind).z3
        if kind.low < 0:
            return z3.And(term.z3 >= low, term.z3 <= high)
        return z3.And(z3.UGE(term.z3, low), z3.ULE(term.z3, high))

    def cast(self, term: Term, kind: Type) -> Term:
        if is_bool(term.type):
            if is_bool(kind):
                return term
            return Term(z3.If(term.z3, *(z3.BitVecVal(bit, width(kind)) for bit in (1, 0))), kind)
        if is_bool(kind):
            return Term(term.z3 != 0, kind)
        return Term(self._bits(term, width(kind)), kind)

    def _bits(self, term: Term, wanted: int) -> z3.BitVecRef:
        """The value modulo 2^wanted."""
        assert isinstance(term.type, Int)
        have = width(term.type)
        if wanted <= have:
            return term.z3 if wanted == have else z3.Extract(wanted - 1, 0, term.z3)
        extend = z3.SignExt if term.type.low < 0 else z3.ZeroExt
        return extend(wanted - have, term.z3)

    def number(self, op: OpName, args: Sequence[Term], kind: Type) -> Term:
        assert isinstance(kind, Int)
        wanted = width(kind)
        match op:
            case "add" | "sub" | "mul" | "neg":  # exact, so the lowest bits of the arguments tell those of the result
                bits = [self._bits(a, wanted) for a in args]
                if op == "neg":
                    return Term(-bits[0], kind)
                x, y = bits
                return Term(x + y if op == "add" else x - y if op == "sub" else x * y, kind)
            case "wrap":
                size = (kind.high - kind.low).bit_length()
                if size == 0:
                    return self.literal(kind.low, kind)
                if kind.low in (0, -(1 << size >> 1)):
                    return Term(self._bits(args[0], wanted), kind)
                offset = self._bits(args[0], size) - z3.BitVecVal(kind.low, size)
                inside = self._bits(Term(offset, Int(0, kind.high - kind.low)), wanted)
                return Term(z3.BitVecVal(kind.low, wanted) + inside, kind)
        low, high = _hull([*(a.type for a in args), kind])
        common = Int(low, max(high, -low))  # with the absolute value of each
        bits = [self._bits(a, width(common)) for a in args]
        signed = low < 0
        a = bits[0]
        match op:
            case "abs":
                made = z3.If(a < 0, -a, a) if signed else a
            case "min" | "max":
                first = _less(a, bits[1], signed=signed)
                made = z3.If(first, a, bits[1]) if op == "min" else z3.If(first, bits[1], a)
            case "div":
                made = a / bits[1] if signed else z3.UDiv(a, bits[1])
            case "mod":
                made = z3.SRem(a, bits[1]) if signed else z3.URem(a, bits[1])
            case _:
                raise AssertionError(op)
        return Term(self._bits(Term(made, common), wanted), kind)

    def compare(self, op: OpName, a: Term, b: Term) -> z3.BoolRef:
        low, high = _hull([a.type, b.type])
        common = Int(low, high)
        x, y = (self._bits(t, width(common)) for t in (a, b))
        signed = low < 0
        match op:
            case "eq":
                return x == y
            case "ne":
                return x != y
            case "lt":
                return _less(x, y, signed=signed)
            case "gt":
                return _less(y, x, signed=signed)
            case "le":
                return z3.Not(_less(y, x, signed=signed))
        return z3.Not(_less(x, y, signed=signed))

    def value(self, model: z3.ModelRef, term: Term) -> int:
        found = model.eval(term.z3, model_completion=True)
        if is_bool(term.type):
            return int(z3.is_true(found))
        assert isinstance(term.type, Int)
        return int(found.as_signed_long() if term.type.low < 0 else found.as_long())


def width(kind: Type) -> int:
    """Bits that hold every value of a type: two's complement where there are negative ones."""
    assert isinstance(kind, Int), "numbers without bounds have no width"
    if kind.low < 0:
        return max((-kind.low - 1).bit_length(), max(kind.high, 0).bit_length()) + 1
    return max(kind.high.bit_length(), 1)


def _hull(kinds: Sequence[Type]) -> tuple[int, int]:
    ints = [k for k in kinds if isinstance(k, Int)]
    assert len(ints) == len(kinds)
    return min(k.low for k in ints), max(k.high for k in ints)


def _less(x: z3.BitVecRef, y: z3.BitVecRef, *, signed: bool) -> z3.BoolRef:
    return x < y if signed else z3.ULT(x, y)
