"""What a search, and the confirmation of its traces, ask of a property, whatever its kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor, never_bad
from llfsm_verify.checking.replay.confirm import Letter, ReplayedRun
from llfsm_verify.logic.formula import atoms
from llfsm_verify.logic.properties import Property


class Unconfirmed(Exception):
    """A violation that could not be confirmed; the message says why. It is no disagreement, and nothing is shown."""


class Goal(Protocol):
    """A property that is checked.

    The search looks for bad prefixes with `monitor`, then, unless the goal `is_safe`, for runs that the automaton of
    its `violations` accepts. What it finds is confirmed by `confirm_prefix` or `violated_by`, which know nothing of
    either.
    """

    @property
    def line(self) -> Property:
        """The line of the property file."""
        ...

    @property
    def atoms(self) -> tuple[str, ...]:
        """The keys of the atoms that it depends on, in the order of the bits that monitor and automaton read."""
        ...

    def monitor(self) -> PrefixMonitor | None:
        """The monitor of bad prefixes; None: only infinite runs can be looked at. AutomatonTooLarge: not even those."""
        ...

    def is_safe(self) -> bool:
        """Whether every run that violates it has a bad prefix; False also where that is not known."""
        ...

    def is_invariant(self) -> bool:
        """Whether every letter that occurs in a run is judged by itself: the runs that violate it are those that show
        some letter which `monitor` refuses as a first one. False also where that is not known."""
        ...

    def violations(self) -> Automaton | Lazy:
        """The automaton of the violating runs, for goals that are not safe. AutomatonTooLarge."""
        ...

    def confirm_prefix(self, replayed: ReplayedRun, what: str) -> None:
        """Raises Disagreement when the letters performed are no bad prefix, Unconfirmed when that is not known."""
        ...

    def violated_by(self, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
        """Whether the run `stem` `loop` `loop` … violates it, by the definition. Unconfirmed: that is not known."""
        ...


def shown_atoms(line: Property) -> tuple[str, ...]:
    """The keys of the atoms that a line has for its user, in order."""
    return tuple(sorted(line.atoms if line.formula is None else atoms(line.formula)))


def mask(letter: Letter, keys: Sequence[str]) -> int:
    """A letter as monitors read it: bit i tells whether atom `keys[i]` holds."""
    return sum(1 << i for i, key in enumerate(keys) if key in letter)


def lost_at(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> int | None:
    """The number of the letter (from 0) that completes a bad prefix; None: `letters` is no bad prefix."""
    state = monitor.initial()
    for number, letter in enumerate(letters):
        if state is not None:
            state = monitor.step(state, mask(letter, keys))
        if state is None:
            return number
    return None


def bad_prefixes_of(goal: Goal) -> tuple[PrefixMonitor | None, bool]:
    """The monitor of a goal's bad prefixes (None: none are looked for), and whether every violation has one.

    LimitReached, AutomatonTooLarge: the goal has neither monitor nor automaton.
    """
    monitor = goal.monitor()
    safe = monitor is not None and goal.is_safe()
    if monitor is not None and not safe and never_bad(monitor, len(goal.atoms)):
        return None, False
    return monitor, safe
