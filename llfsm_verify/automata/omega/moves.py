"""What an automaton can do with one letter, remembered."""

from __future__ import annotations

from typing import Protocol

from llfsm_verify.automata.automaton import Automaton


class Lazy(Protocol):
    """A transition-based generalised Büchi automaton whose states are made when they are asked for; 0 is initial."""

    @property
    def relevant(self) -> int:
        """The mask of the atoms that the automaton looks at."""
        ...

    @property
    def acceptance_sets(self) -> int: ...

    @property
    def is_empty(self) -> bool:
        """There is no initial state."""
        ...

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of each move from `state` with `letter` (the mask of the atoms that hold)."""
        ...


def moves_of(automaton: Automaton | Lazy) -> Lazy:
    """The moves of an automaton of either form."""
    return Moves(automaton) if isinstance(automaton, Automaton) else automaton


class Moves:
    """The moves of `automaton` by state and letter, without those that another one to the same state makes needless."""

    def __init__(self, automaton: Automaton) -> None:
        self._edges = automaton.edges
        self.acceptance_sets = automaton.acceptance_sets
        self.is_empty = automaton.is_empty
        self.relevant = 0
        """The mask of the atoms that the automaton looks at."""
        for row in automaton.edges:
            for edge in row:
                self.relevant |= edge.positive | edge.negative
        self._known: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {}

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of each move from `state` with `letter` (the mask of the atoms that hold)."""
        key = (state, letter & self.relevant)
        moves = self._known.get(key)
        if moves is None:
            moves = self._known[key] = self._moves(*key)
        return moves

    def _moves(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        best: dict[int, list[int]] = {}
        for edge in self._edges[state]:
            if edge.allows(letter):
                masks = best.setdefault(edge.target, [])
                if not any(edge.acceptance & ~mask == 0 for mask in masks):
                    masks[:] = [mask for mask in masks if mask & ~edge.acceptance]
                    masks.append(edge.acceptance)
        return tuple((mask, target) for target, masks in best.items() for mask in masks)
