"""What of the letter that closes a bad prefix would have to be otherwise, for properties that only a monitor knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.checking.goals.goal import mask
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import exclusions

ALL_SETS = 12
"""Atoms up to which every set of changes is tried."""
SMALL_SETS = 3
"""The size of the sets that are tried among more atoms."""

Letter = frozenset[str]


def changes(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> frozenset[str]:
    """The atoms in the least sets of atoms whose change in the last of `letters`, a bad prefix, makes it none.

    With them changed a machine is still in one state at a time. Empty: whatever the letter had shown, or the first
    letter closes the prefix already before it is read.
    """
    state = _before_last(monitor, keys, letters)
    if state is None or not letters:
        return frozenset()
    last, found = letters[-1], list[frozenset[str]]()
    own = [key for key in keys if not key.startswith(HIDDEN)]
    world = exclusions(own)
    for changed in _sets(own):
        if any(known <= changed for known in found):
            continue
        other = last ^ changed
        if evaluate(world, (), (other,)) and monitor.step(state, mask(other, keys)) is not None:
            found.append(changed)
    return frozenset().union(*found)


def possible(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> list[Letter] | None:
    """All letters in place of the last of `letters` with which they are no bad prefix; None: there are too many."""
    own = [key for key in keys if not key.startswith(HIDDEN)]
    if len(own) > ALL_SETS:
        return None
    state, world = _before_last(monitor, keys, letters), exclusions(own)
    if state is None:
        return []
    every = (frozenset[str](), *_sets(own))
    return [x for x in every if monitor.step(state, mask(x, keys)) is not None and evaluate(world, (), (x,))]


def _before_last(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> int | None:
    """The state before the last letter; None: a bad prefix ends before it."""
    state = monitor.initial()
    for letter in letters[:-1]:
        if state is None:
            return None
        state = monitor.step(state, mask(letter, keys))
    return state


def _sets(keys: Sequence[str]) -> Iterator[frozenset[str]]:
    """Sets of atoms, small ones first."""
    most = len(keys) if len(keys) <= ALL_SETS else SMALL_SETS
    return (frozenset(chosen) for size in range(1, most + 1) for chosen in combinations(keys, size))
