"""Regular properties by their page: automata of Thompson's, followed in sets, on every run of a graph.

Nothing of `llfsm_verify.automata` or `llfsm_verify.logic` is used.
"""

from __future__ import annotations

import re
from functools import cache
from itertools import product

from tests.oracle.formulas import Tree, atoms, holds, parts
from tests.oracle.graph import Graph, Letter

Valuation = tuple[bool, ...]
"""Which letters of the expression hold."""
IN_STATE = re.compile(r"(\w+)@\w+")


class Rule:
    """`enforce`, `forbid` or `forbid initially` of an expression. `void`: it is an error, by its code."""

    def __init__(self, kind: str, expression: Tree) -> None:
        self.kind = kind
        self.letters = list(dict.fromkeys(p[1] for p in parts(expression) if p[0] == "letter"))
        self.possible = frozenset(map(self.valuation, _worlds(atoms(expression))))
        self._empty: list[list[int]] = []
        self._moves: list[list[tuple[int, int]]] = []
        self._start, self._end = self._build(expression)
        alive = self._alive(self._start, None)
        self.void = "E344" if not alive else None
        if kind != "enforce" and self._end in self._closed(self._start):
            self.void = "E342"

    def valuation(self, letter: Letter) -> Valuation:
        return tuple(holds(f, letter) for f in self.letters)

    def _state(self) -> int:
        self._empty.append([])
        self._moves.append([])
        return len(self._empty) - 1

    def _build(self, r: Tree) -> tuple[int, int]:
        """The first and the last state of the part for `r` (Thompson, CACM 11, 1968)."""
        first, last = self._state(), self._state()
        match r:
            case ("letter", f):
                self._moves[first].append((self.letters.index(f), last))
            case ("seq", a, b):
                (a1, a2), (b1, b2) = self._build(a), self._build(b)
                self._empty[first].append(a1)
                self._empty[a2].append(b1)
                self._empty[b2].append(last)
            case ("alt", a, b):
                for part in (a, b):
                    p1, p2 = self._build(part)
                    self._empty[first].append(p1)
                    self._empty[p2].append(last)
            case ("repeat", a, low, high):
                at = first
                for number in range(low if high is None else high):
                    p1, p2 = self._build(a)
                    if number >= low:
                        self._empty[at].append(last)
                    self._empty[at].append(p1)
                    at = p2
                if high is None:
                    p1, p2 = self._build(a)
                    self._empty[at].append(p1)
                    self._empty[p2].append(at)
                self._empty[at].append(last)
        return first, last

    @cache  # noqa: B019 - rules are few and small
    def _closed(self, state: int) -> frozenset[int]:
        found, todo = {state}, [state]
        while todo:
            for target in self._empty[todo.pop()]:
                if target not in found:
                    found.add(target)
                    todo.append(target)
        return frozenset(found)

    @cache  # noqa: B019
    def _after(self, state: int, valuation: Valuation) -> frozenset[int]:
        """The states after one letter, each before its empty moves."""
        return frozenset(t for q in self._closed(state) for letter, t in self._moves[q] if valuation[letter])

    @cache  # noqa: B019
    def _alive(self, state: int, last: Valuation | None) -> bool:
        """Whether some word without equal neighbours goes on from here, where `last` was shown, to a match."""
        seen, todo = {(state, last)}, [(state, last)]
        while todo:
            q, v = todo.pop()
            if self._end in self._closed(q):
                return True
            for shown in self.possible:
                if shown != v:
                    for pair in ((t, shown) for t in self._after(q, shown)):
                        if pair not in seen:
                            seen.add(pair)
                            todo.append(pair)
        return False

    def _read(self, states: frozenset[int], shown: Valuation, first: bool) -> frozenset[int] | None:
        """Where the parts of the word that are followed may be after one more letter; None: it is violated."""
        if first or self.kind == "forbid":
            states |= {self._start}
        after = frozenset(t for q in states for t in self._after(q, shown))
        if self.kind == "enforce":
            return after if any(self._alive(q, shown) for q in after) else None
        return None if any(self._end in self._closed(q) for q in after) else after

    def shortest(self, graph: Graph) -> int | None:
        """The fewest steps after which some run violates the property; None: none does."""
        layer = set()
        for root, letter in graph.roots:
            shown = self.valuation(letter)
            layer.add((root, shown, self._read(frozenset(), shown, True)))
        seen, steps = set(layer), 0
        while layer:
            if any(states is None for _, _, states in layer):
                return steps
            following = set()
            for node, last, states in layer:
                assert states is not None
                for edge in graph.edges[node]:
                    shown = self.valuation(edge.letter)
                    after = states if shown == last else self._read(states, shown, False)
                    following.add((edge.target, shown, after))
            layer = following - seen
            seen |= layer
            steps += 1
        return None


def _worlds(names: list[str]) -> list[Letter]:
    """The letters that some configuration could show: all combinations of atoms, but no machine is in two states."""
    found = []
    for row in product((False, True), repeat=len(names)):
        letter = frozenset(n for n, there in zip(names, row, strict=True) if there)
        machines = [m[1] for m in map(IN_STATE.fullmatch, letter) if m is not None]
        if len(machines) == len(set(machines)):
            found.append(letter)
    return found
