"""Which states a run has visited: those in which a machine was at first, or after a step."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from llfsm_verify.backends.native.executor import Data
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.language.scope import IMPLICIT_SUSPEND
from llfsm_verify.program.program import Program

MOST = 30
"""States of a sentence."""
State = tuple[str, str]
"""A machine and its state."""


class Visits:
    """The states that a run visits, record by record."""

    def __init__(self, program: Program, layout: Layout) -> None:
        self._states = states_of(program)
        self._readers = [(layout.reader(name), begin) for name, begin in state_places(program)]
        self._seen: set[State] = set()

    def see(self, record: Data) -> None:
        """A record in which the run stands."""
        self._seen.update(self._states[begin + read(record)] for read, begin in self._readers)

    @property
    def never(self) -> dict[str, tuple[str, ...]]:
        """By machine, the states that were never visited; machines without one are left out."""
        return unvisited(self._states, self._seen)


def states_of(program: Program) -> list[State]:
    """All states, machine by machine."""
    return [(machine.name, state) for machine in program.machines for state in machine.states]


def state_places(program: Program) -> Iterator[tuple[str, int]]:
    """The variable of each machine's state, and where its states begin in `states_of`."""
    names, begin = {variable.name for variable in program.vars}, 0
    for machine in program.machines:
        if f"{machine.name}.$state" in names:
            yield f"{machine.name}.$state", begin
        begin += len(machine.states)


def unvisited(states: Iterable[State], seen: Collection[State]) -> dict[str, tuple[str, ...]]:
    """By machine, the states that are not among those `seen`. Those that were not noted are left out."""
    found: dict[str, tuple[str, ...]] = {}
    for machine, state in states:
        if (machine, state) not in seen and state != IMPLICIT_SUSPEND:
            found[machine] = (*found.get(machine, ()), state)
    return found


def never_visited(never: Mapping[str, tuple[str, ...]]) -> str:
    """A sentence about states that were never visited."""
    names = [f"{machine}@{state}" for machine, states in never.items() for state in states]
    more = f" and {len(names) - MOST:,} more" if len(names) > MOST else ""
    return f"Never visited: {', '.join(names[:MOST])}{more}." if names else "Every state was visited."
