"""Formulas as certificates write them: a list of nodes over `not`, `and`, `X`, `U`, `R` and bits of letters."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce

from llfsm_verify.jsonvalue import Json
from llfsm_verify.logic.bounds import without_steps
from llfsm_verify.logic.formula import Formula, is_plain, postorder


def formula_json(formula: Formula | None, bits: Mapping[str, int]) -> Json:
    """[operator, operand, operand] of each subformula, operands by the index of earlier ones (twice for unary ones).

    ["atom", bit, 0] is a bit of the letters. None for what is not plain temporal logic: past, bounds in time, regular
    expressions.
    """
    if formula is None:
        return None
    plain = without_steps(formula)
    return _Writer(bits).written(plain) if is_plain(plain) else None


class _Writer:
    def __init__(self, bits: Mapping[str, int]) -> None:
        self._bits = bits
        self._nodes: list[Json] = []
        self._known: dict[tuple[str, int, int], int] = {}

    def written(self, formula: Formula) -> list[Json]:
        done: dict[Formula, int] = {}
        for node in postorder(formula):
            done[node] = self._node(node, [done[a] for a in node.args])
        return self._nodes  # the last one is the formula: the others are parts of it

    def _add(self, op: str, a: int, b: int) -> int:
        number = self._known.setdefault((op, a, b), len(self._nodes))
        if number == len(self._nodes):
            self._nodes.append([op, a, b])
        return number

    def _not(self, a: int) -> int:
        return self._add("not", a, a)

    def _or(self, a: int, b: int) -> int:
        return self._not(self._add("and", self._not(a), self._not(b)))

    def _true(self) -> int:
        return self._add("true", 0, 0)

    def _node(self, node: Formula, args: list[int]) -> int:
        a, b = (args[0], args[-1]) if args else (0, 0)
        match node.op:
            case "true":
                return self._true()
            case "false":
                return self._not(self._true())
            case "atom":
                return self._add("atom", self._bits[node.key], 0)
            case "not":
                return self._not(a)
            case "and":
                return reduce(lambda x, y: self._add("and", x, y), args)
            case "or":
                return reduce(self._or, args)
            case "implies":
                return self._or(self._not(a), b)
            case "iff" | "xor":
                same = self._or(self._add("and", a, b), self._add("and", self._not(a), self._not(b)))
                return same if node.op == "iff" else self._not(same)
            case "X":
                return self._add("X", a, a)
            case "F":
                return self._add("U", self._true(), a)
            case "G":
                return self._add("R", self._not(self._true()), a)
            case "U" | "R":
                return self._add(node.op, a, b)
            case "W":  # a W b = b R (b || a)
                return self._add("R", b, self._or(b, a))
            case "M":  # a M b = b U (b && a)
                return self._add("U", b, self._add("and", b, a))
        raise AssertionError(node.op)
