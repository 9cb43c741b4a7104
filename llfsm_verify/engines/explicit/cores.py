"""Which states of an automaton can lie on an accepting loop: only with these is the product searched for components.

The other states need no more than to be reached, which takes a tenth of the time. In the negation of ``G (a -> F b)``
these are the states before the `a` that is not answered, with which nearly all nodes of the product are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from llfsm_verify.automata.omega.components import components
from llfsm_verify.kripke.product import NO_STATE
from llfsm_verify.kripke.reading import Move
from llfsm_verify.limits import tick

JointStep = Callable[[int, int], Sequence[Move]]


class Cores:
    """The strongly connected components of an automaton whose moves inside are together in all acceptance sets.

    An accepting run stays in one of them from some point on. `step` gives the automaton's moves by state and letter.
    The states of cores have numbers of their own, 0, 1, …
    """

    def __init__(self, step: JointStep, letters: Sequence[int], sets: int, most: int) -> None:
        """`letters`: one of each class; at most `most` rows of moves are looked at."""
        self._step = step
        self._letters = letters
        self._full = (1 << sets) - 1
        self._left = most
        self._moves: dict[int, list[Move]] = {}
        self._core: dict[int, int] = {}
        self._useful: set[int] = set()
        self._states: list[int] = []
        self._numbers: dict[int, int] = {}
        self.unknown = False
        """There were too many rows: every state counts as one of a core, under its own number."""
        self.numbers: list[int] = []
        """By state: its number among the states of cores, or NO_STATE."""

    def add(self, states: Iterable[int]) -> None:
        """Look at what can be reached from these states."""
        todo = [state for state in dict.fromkeys(states) if state not in self._moves]
        if self.unknown or not todo:
            return
        while todo:
            state = todo.pop()
            if state in self._moves:
                continue
            tick()
            self._left -= len(self._letters)
            if self._left < 0:
                self.unknown = True
                return
            row = dict.fromkeys(move for letter in self._letters for move in self._step(state, letter))
            self._moves[state] = list(row)
            todo += [target for target, _ in row]
        self._divide()

    @property
    def single(self) -> bool:
        """Every state that was looked at is in the same core, or is taken to be."""
        return self.unknown or (len(self._core) == len(self._moves) and len(set(self._core.values())) == 1)

    def is_useful(self, state: int) -> bool:
        """Whether a core can be reached."""
        return self.unknown or state in self._useful

    def toward(self, state: int, letter: int) -> Iterable[Move]:
        """The moves from which a core can be reached."""
        return [move for move in self._step(state, letter) if self.is_useful(move[0])]

    def inside(self, number: int, letter: int) -> Sequence[Move]:
        """The moves inside a core, by numbers of the states of cores."""
        if self.unknown:
            return self._step(number, letter)
        state = self._states[number]
        core = self._core[state]
        moves = self._step(state, letter)
        return [(self._numbers[target], mask) for target, mask in moves if self._core.get(target) == core]

    def _divide(self) -> None:
        states = sorted(self._moves)
        place = {state: i for i, state in enumerate(states)}
        parts = components([[place[target] for target, _ in self._moves[state]] for state in states])
        shown: dict[int, int] = {}
        for state, part in zip(states, parts, strict=True):
            for target, mask in self._moves[state]:
                if parts[place[target]] == part:
                    shown[part] = shown.get(part, 0) | mask
        cores = {part for part, mask in shown.items() if mask == self._full}
        useful = set(cores)
        # Edges never lead to a component of a higher number.
        for part, state in sorted(zip(parts, states, strict=True)):
            if any(parts[place[target]] in useful for target, _ in self._moves[state]):
                useful.add(part)
        self._core = {state: part for state, part in zip(states, parts, strict=True) if part in cores}
        self._useful = {state for state, part in zip(states, parts, strict=True) if part in useful}
        for state in self._core:
            if self._numbers.setdefault(state, len(self._states)) == len(self._states):
                self._states.append(state)
        self.numbers = [self._numbers.get(state, NO_STATE) for state in range(max(states) + 1)]
