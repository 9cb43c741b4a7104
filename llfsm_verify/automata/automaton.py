"""Büchi automata whose acceptance is on transitions, with any number of acceptance sets."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Edge:
    """A transition for all letters in which the atoms of `positive` hold and those of `negative` do not.

    `positive` and `negative` are disjoint masks: bit i is atom i of the automaton. Bit k of `acceptance`: the
    transition is in acceptance set k.
    """

    positive: int
    negative: int
    target: int
    acceptance: int

    def allows(self, letter: int) -> bool:
        """`letter` is the mask of the atoms that hold."""
        return self.positive & ~letter == 0 and self.negative & letter == 0


@dataclass(frozen=True, slots=True)
class Automaton:
    """A transition-based generalised Büchi automaton.

    `edges[q]` are the transitions of state q; state 0 is initial; without states the language is empty. A word is
    accepted when it has a run that takes transitions of every acceptance set infinitely often (any infinite run when
    there are no sets).
    """

    atoms: tuple[str, ...]
    edges: tuple[tuple[Edge, ...], ...]
    acceptance_sets: int

    @property
    def is_empty(self) -> bool:
        """There are no states (after `translate`: no word is accepted)."""
        return not self.edges

    @property
    def full(self) -> int:
        """The mask of all acceptance sets."""
        return (1 << self.acceptance_sets) - 1

    @property
    def transitions(self) -> int:
        """The number of transitions."""
        return sum(map(len, self.edges))

    def letter(self, true_atoms: Collection[str]) -> int:
        """The mask of a letter given by the keys of its true atoms; others than `atoms` do not matter."""
        return sum(1 << i for i, key in enumerate(self.atoms) if key in true_atoms)


class AutomatonTooLarge(Exception):
    """A construction passed its limit of states or transitions."""

    def __init__(self, what: str, limit: int) -> None:
        self.limit = limit
        super().__init__(f"the automaton has more than {limit:,} {what}")
