"""What an automaton does with the labels of a graph: letters, or words of them, divided by what of them matters."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable

from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.sequences import NO_PREFIX
from llfsm_verify.limits import tick

Move = tuple[int, int]
"""A move of an automaton: its target, and the mask of the acceptance sets it is in."""
ENTER_WORK = 1 << 16
"""Words divided into classes between two looks at the limits."""


class LabelClasses:
    """The labels of a graph, divided: by the classes of their letters, in order.

    Class c of a graph without chains is that of ``letters[c]``. Else it is that of the words of class
    ``prefixes[c]`` (-1: the empty word) followed by a letter of the class of ``letters[last[c]]``.
    """

    def __init__(self, graph: Graph, bits: int) -> None:
        """Letters that agree in all `bits`, a mask, are one class."""
        numbers: dict[int, int] = {}
        of_letter = array("I", (numbers.setdefault(letter & bits, len(numbers)) for letter in graph.alphabet))
        self.letters: list[int] = []
        """A letter of each class of letters."""
        for letter, number in zip(graph.alphabet, of_letter, strict=True):
            if number == len(self.letters):
                self.letters.append(letter)
        self.prefixes, self.last = array("q", [-1]) * len(self.letters), array("I", range(len(self.letters)))
        self.of_label = of_letter
        if graph.sequences is not None:
            self.prefixes, self.last, self.of_label = array("q"), array("I"), array("I")
            self._divide(graph.sequences.pairs(), of_letter)

    def __len__(self) -> int:
        return len(self.last)

    def _divide(self, pairs: array[int], of_letter: array[int]) -> None:
        numbers: dict[int, int] = {}
        of_word = self.of_label
        for word, pair in enumerate(pairs):
            prefix, last = pair >> 32, of_letter[pair & NO_PREFIX]
            before = -1 if prefix == NO_PREFIX else of_word[prefix]
            number = numbers.setdefault((before + 1) << 32 | last, len(numbers))
            if number == len(self.last):
                self.prefixes.append(before)
                self.last.append(last)
            of_word.append(number)
            if word % ENTER_WORK == 0:
                tick()


class Reading:
    """The moves of an automaton, given letter by letter, with whole labels."""

    def __init__(
        self,
        classes: LabelClasses,
        step: Callable[[int, int], Iterable[Move]],
        ends: Callable[[int], bool] | None = None,
    ) -> None:
        """``step(state, letter)`` gives the moves with the letters of a class, for any letter of it. There are no moves
        from states that `ends` tells, but inside a word it is read on from them."""
        self._classes = classes
        self._step = step
        self._ends = ends
        self._known: dict[tuple[int, int], tuple[Move, ...]] = {}

    def __call__(self, state: int, label_class: int) -> tuple[Move, ...]:
        """(target, acceptance) of each way to read a label of a class: the acceptance of all its letters, joined."""
        if self._ends is not None and self._ends(state):
            return ()
        classes, rest = self._classes, []
        if classes.prefixes[label_class] < 0:
            return tuple(self._step(state, classes.letters[classes.last[label_class]]))
        before: tuple[Move, ...] | None = None
        while before is None and label_class >= 0:
            before = self._known.get((state, label_class))
            if before is None:
                rest.append(label_class)
                label_class = classes.prefixes[label_class]
        moves = before if before is not None else ((state, 0),)
        for number in reversed(rest):
            moves = self._known[state, number] = self._extended(moves, classes.letters[classes.last[number]])
        return moves

    def _extended(self, moves: tuple[Move, ...], letter: int) -> tuple[Move, ...]:
        """One letter more; without moves that one to the same state, in more acceptance sets, makes needless."""
        best: dict[int, list[int]] = {}
        for middle, before in moves:
            for target, acceptance in self._step(middle, letter):
                mask, masks = before | acceptance, best.setdefault(target, [])
                if not any(mask & ~known == 0 for known in masks):
                    masks[:] = [known for known in masks if known & ~mask]
                    masks.append(mask)
        return tuple((target, mask) for target, masks in best.items() for mask in masks)
