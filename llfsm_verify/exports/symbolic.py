"""Blocks as expressions for other checkers, whose integers have 32 bits and whose division is not C's."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.exports.flat import fits
from llfsm_verify.program import symbolic
from llfsm_verify.program.program import Const, Expr, Int, Op, OpName, Type
from llfsm_verify.program.symbolic import typed
from llfsm_verify.program.terms import const, interval, ite, op


@dataclass(slots=True)
class Definitions(symbolic.Definitions):
    """Intermediate expressions in the operations on which all checkers agree."""

    def operation(self, name: OpName, args: list[Expr], kind: Type) -> Expr:
        """Operations that checkers understand in different ways, or not at all, in terms of the plain ones."""
        match name, args:
            case "min" | "max", [a, b]:
                return ite(self.name(op("lt" if name == "min" else "gt", a, b)), a, b)
            case "abs", [a]:
                return self._absolute(a)
            case "div" | "mod", [a, b]:
                return self._divided(name, a, b)
            case "wrap", [a]:
                assert isinstance(kind, Int)
                size = const(kind.high - kind.low + 1)
                part = self.name(self._divided("mod", a, size))
                rest = self.name(ite(self.name(op("lt", part, const(0))), self.name(op("add", part, size)), part))
                high = self.name(op("gt", rest, const(kind.high)))
                return typed(ite(high, self.name(op("sub", rest, size)), rest), kind)
        return op(name, *args)

    def _absolute(self, a: Expr) -> Expr:
        bounds = interval(a)
        if bounds is not None and bounds[0] >= 0:
            return a
        positive = ite(self.name(op("lt", a, const(0))), self.name(op("neg", a)), a)
        return typed(positive, Int(0, max(abs(bounds[0]), abs(bounds[1]))) if bounds else a.type)

    def _divided(self, name: str, a: Expr, b: Expr) -> Expr:
        """Division as in C, by divisions of numbers that are not negative, on which all agree."""
        above, below = interval(a), interval(b)
        assert above is not None
        assert below is not None
        if below[0] <= 0 <= below[1]:  # a fault before this; some checkers divide all the same
            b = self.name(ite(self.name(op("eq", b, const(0))), const(1), b))
        size_a, size_b = self.name(self._absolute(a)), self.name(self._absolute(b))
        high = max(abs(above[0]), abs(above[1]))
        if isinstance(size_a, Const) and isinstance(size_b, Const):
            plain: Expr = const(size_a.value // size_b.value if name == "div" else size_a.value % size_b.value)
        else:
            plain = self.name(Op("div" if name == "div" else "mod", (size_a, size_b), Int(0, high)))
        negative = op("lt", a, const(0))
        if name == "div":
            negative = op("ne", self.name(negative), self.name(op("lt", b, const(0))))
        return ite(self.name(negative), self.name(op("neg", plain)), plain)

    def name(self, e: Expr) -> Expr:
        """The same. Raises DiagnosticError (E421) for what 32 bits do not hold."""
        if not fits(e.type):
            raise DiagnosticError(
                Diagnostic(
                    "E421",
                    "a calculation can leave 32 bits, and the integers of this format have no more",
                    hint="declare smaller ranges, so that no intermediate value leaves them",
                )
            )
        return symbolic.Definitions.name(self, e)
