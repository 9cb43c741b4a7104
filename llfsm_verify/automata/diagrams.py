"""Reduced ordered binary decision diagrams, for alphabets of too many atoms for truth tables."""

from __future__ import annotations

from llfsm_verify.automata.automaton import AutomatonTooLarge

MAX_NODES = 250_000
MAX_KNOWN = 1_000_000
"""Nodes of all diagrams of an alphabet together, and intersections remembered before they are forgotten."""


class Diagram:
    """A node: if atom `level` holds, `high`, else `low`. Made by `Diagrams` only, so that equal functions are one."""

    __slots__ = ("_negation", "_owner", "high", "level", "low", "number")

    def __init__(self, owner: Diagrams, level: int, low: Diagram | None, high: Diagram | None, number: int) -> None:
        self._owner = owner
        self.level = level
        self.low = self if low is None else low
        self.high = self if high is None else high
        self.number = number
        self._negation: Diagram | None = None

    def __and__(self, other: Diagram) -> Diagram:
        return self._owner.conjunction(self, other)

    def __or__(self, other: Diagram) -> Diagram:
        return ~self._owner.conjunction(~self, ~other)

    def __invert__(self) -> Diagram:
        return self._negation or self._owner.negation(self)

    def __bool__(self) -> bool:
        return self is not self._owner.false

    def __hash__(self) -> int:
        return self.number


class Diagrams:
    """The alphabet whose sets of letters are decision diagrams; atom 0 is asked first.

    Source: Bryant, Graph-based algorithms for Boolean function manipulation, IEEE Trans. Computers 35 (1986); without
    recursion. AutomatonTooLarge: the diagrams have more than `MAX_NODES` nodes.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self.false = Diagram(self, size, None, None, 0)
        self.true = Diagram(self, size, None, None, 1)
        self._set_opposites(self.false, self.true)
        self._unique: dict[tuple[int, Diagram, Diagram], Diagram] = {}
        self._conjunctions: dict[tuple[Diagram, Diagram], Diagram] = {}

    def atom(self, i: int) -> Diagram:
        """The letters in which atom i holds."""
        return self._node(i, self.false, self.true)

    def split(self, lower: Diagram, upper: Diagram, first: int) -> tuple[int, Diagram, Diagram, Diagram, Diagram]:
        """As `Alphabet.split`."""
        i = min(lower.level, upper.level)
        if not first <= i < self.size:
            raise ValueError("a constant has no cofactors")
        return i, *_cofactors(lower, i), *_cofactors(upper, i)

    def _node(self, level: int, low: Diagram, high: Diagram) -> Diagram:
        if low is high:
            return low
        key = (level, low, high)
        found = self._unique.get(key)
        if found is None:
            if len(self._unique) >= MAX_NODES:
                raise AutomatonTooLarge("nodes in the decision diagrams of its letters", MAX_NODES)
            found = self._unique[key] = Diagram(self, level, low, high, len(self._unique) + 2)
        return found

    @staticmethod
    def _set_opposites(a: Diagram, b: Diagram) -> None:
        a._negation, b._negation = b, a

    def negation(self, f: Diagram) -> Diagram:
        """The complement."""
        stack = [f]
        while stack:
            node = stack[-1]
            if node._negation is not None:
                stack.pop()
                continue
            low, high = node.low._negation, node.high._negation
            if low is None or high is None:
                stack += [child for child in (node.low, node.high) if child._negation is None]
            else:
                self._set_opposites(node, self._node(node.level, low, high))
        assert f._negation is not None
        return f._negation

    def conjunction(self, f: Diagram, g: Diagram) -> Diagram:
        """The intersection."""
        found = self._known(f, g)
        if found is not None:
            return found
        if len(self._conjunctions) > MAX_KNOWN:
            self._conjunctions.clear()
        stack = [(f, g)]
        while stack:
            a, b = stack[-1]
            if self._known(a, b) is not None:
                stack.pop()
                continue
            level = min(a.level, b.level)
            (a0, a1), (b0, b1) = _cofactors(a, level), _cofactors(b, level)
            low, high = self._known(a0, b0), self._known(a1, b1)
            if low is None:
                stack.append((a0, b0))
            elif high is None:
                stack.append((a1, b1))
            else:
                key = (a, b) if a.number <= b.number else (b, a)
                self._conjunctions[key] = self._node(level, low, high)
        found = self._known(f, g)
        assert found is not None
        return found

    def _known(self, a: Diagram, b: Diagram) -> Diagram | None:
        if a is b or b is self.true:
            return a
        if a is self.true:
            return b
        if a is self.false or b is self.false or a._negation is b:
            return self.false
        return self._conjunctions.get((a, b) if a.number <= b.number else (b, a))


def _cofactors(f: Diagram, level: int) -> tuple[Diagram, Diagram]:
    return (f.low, f.high) if f.level == level else (f, f)
