"""The minimal deterministic automaton with the verdicts true, false and not yet."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from enum import Enum

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.components import reaching
from llfsm_verify.automata.omega.refinement import by_class, equivalent
from llfsm_verify.automata.omega.subsets import Step

MAX_EDGES = 200_000


class MonitorVerdict(Enum):
    """What holds for all continuations of the word read."""

    TRUE = "true"
    """All of them satisfy the property."""
    FALSE = "false"
    """None of them satisfies it."""
    NOT_YET = "not yet"
    """Some do, some do not."""


class Monitorability(Enum):
    """Whether reading on can still give a verdict."""

    ALWAYS = "always"
    """After every word some continuation gives a verdict."""
    SOMETIMES = "sometimes"
    """At first, but there are words after which no continuation does."""
    NEVER = "never"
    """No word gives a verdict: the property cannot be monitored."""


@dataclass(frozen=True, slots=True)
class MonitorEdge:
    """A step for all letters in which the atoms of `positive` hold and those of `negative` do not (bit i: atom i)."""

    positive: int
    negative: int
    target: int

    def allows(self, letter: int) -> bool:
        """`letter` is the mask of the atoms that hold."""
        return self.positive & ~letter == 0 and self.negative & letter == 0


@dataclass(frozen=True, slots=True)
class Monitor:
    """A minimal deterministic and complete automaton; state 0 is initial.

    `verdicts[q]` is the verdict in state q; a state with one is never left. `edges[q]`: all that allow a letter lead to
    one state, and for each letter there are some. `hopeless[q]`: no continuation gives a verdict any more.
    """

    atoms: tuple[str, ...]
    verdicts: tuple[MonitorVerdict, ...]
    edges: tuple[tuple[MonitorEdge, ...], ...]
    hopeless: tuple[bool, ...]

    @property
    def monitorability(self) -> Monitorability:
        """Whether a verdict can be reached from every state, or from the initial one at least."""
        if self.hopeless[0]:
            return Monitorability.NEVER
        return Monitorability.SOMETIMES if any(self.hopeless) else Monitorability.ALWAYS

    @property
    def used(self) -> int:
        """The mask of the atoms that matter."""
        mask = 0
        for row in self.edges:
            for edge in row:
                mask |= edge.positive | edge.negative
        return mask

    def step(self, state: int, letter: int) -> int:
        """The state after `letter`, the mask of the atoms that hold."""
        for edge in self.edges[state]:
            if edge.allows(letter):
                return edge.target
        raise AssertionError("a monitor has a step for every letter")

    def letter(self, true_atoms: Collection[str]) -> int:
        """The mask of a letter given by the keys of its true atoms; others than `atoms` do not matter."""
        return sum(1 << i for i, key in enumerate(self.atoms) if key in true_atoms)

    def verdict(self, word: Sequence[Collection[str]]) -> MonitorVerdict:
        """The verdict after `word`, whose letters are given by their true atoms."""
        state = 0
        for letter in word:
            state = self.step(state, self.letter(letter))
        return self.verdicts[state]


Cubes = Callable[[dict[int, L]], dict[int, list[tuple[int, int]]]]
"""From the disjoint sets of letters that lead to each target, the cubes for each: positive and negative atoms."""


def minimal(
    keys: Sequence[str],
    verdicts: Sequence[MonitorVerdict],
    rows: Sequence[Sequence[Step[L]]],
    cubes: Cubes[L],
    max_edges: int = MAX_EDGES,
) -> Monitor:
    """The smallest monitor that gives the same verdicts as a deterministic automaton all of whose states are reachable.

    AutomatonTooLarge: more than `max_edges` cubes.
    """
    order = list(MonitorVerdict)
    blocks = equivalent(rows, [order.index(verdict) for verdict in verdicts])
    first: dict[int, int] = {}
    for state, block in enumerate(blocks):
        first.setdefault(block, state)
    edges: list[tuple[MonitorEdge, ...]] = []
    made = 0
    for state in first.values():
        steps = cubes(by_class(rows[state], blocks))
        row = tuple(MonitorEdge(p, n, target) for target, found in steps.items() for p, n in found)
        made += len(row)
        if made > max_edges:
            raise AutomatonTooLarge("transitions", max_edges)
        edges.append(row)
    found = tuple(verdicts[state] for state in first.values())
    targets = [[edge.target for edge in row] for row in edges]
    hope = reaching(targets, [verdict is not MonitorVerdict.NOT_YET for verdict in found])
    return Monitor(tuple(keys), found, tuple(edges), tuple(not has for has in hope))
