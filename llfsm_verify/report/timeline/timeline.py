"""What happened over time: signals, and a row of their values for each moment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import islice
from typing import NamedTuple

from llfsm_verify.program.program import Int
from llfsm_verify.values import Shown

NANOSECONDS = 1_000_000
"""Of a millisecond. Rows of one cycle follow each other by one of them, so that each can be seen."""
UNTIMED_CYCLE = 1000
"""Nanoseconds that a cycle of an untimed arrangement takes in the file."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A slot over time: the state of a machine, a variable, an input."""

    name: str
    kind: str
    """As of `runtime.live.slots.Slot`."""
    type: Int
    labels: tuple[str, ...]


class Row(NamedTuple):
    """The values of all signals at one moment."""

    step: int
    """Ringlets so far."""
    cycle: int
    """The cycle of logical time in which that was; 0 before it."""
    values: tuple[Shown, ...]
    """In the order of the signals."""
    fired: tuple[str, ...] = ()
    """``ns: RED -> GREEN when car`` of the transition that fired since the row before; of a trace only."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Signals and rows, which can be read once, in their order."""

    title: str
    signals: tuple[Signal, ...]
    rows: Iterable[Row]
    cycle_ms: Fraction | None
    """Logical time of a cycle; None: the arrangement is untimed."""
    loop: int | None = None
    """The step from which on the run repeats forever, if it does."""
    begins: int = 0
    """The cycle that begins at time 0. A step has the time at which its cycle begins, as bounds in time count it, so
    that this is cycle 1; a frame of a recording has the time at which its cycle is over."""

    def part(self, first: int, last: int | None) -> Timeline:
        """The rows of the steps from `first` to `last`; one before them says how things stand."""
        return replace(self, rows=_part(self.rows, first, last))

    def time_ms(self, row: Row) -> Fraction | None:
        """Logical time of a row in milliseconds."""
        return None if self.cycle_ms is None else self._passed(row) * self.cycle_ms

    def nanoseconds(self, row: Row) -> int:
        """The same for viewers; a cycle of an untimed arrangement takes UNTIMED_CYCLE."""
        return self._passed(row) * (UNTIMED_CYCLE if self.cycle_ms is None else int(self.cycle_ms * NANOSECONDS))

    def _passed(self, row: Row) -> int:
        return max(row.cycle - self.begins, 0)


def _part(rows: Iterable[Row], first: int, last: int | None) -> Iterator[Row]:
    before = None
    for row in rows:
        if last is not None and row.step > last:
            return
        if row.step < first:
            before = row
            continue
        if before is not None:
            yield before
            before = None
        yield row


def take(rows: Iterable[Row], most: int) -> tuple[list[Row], bool]:
    """So many rows at most, and whether there were more."""
    found = list(islice(rows, most + 1))
    return found[:most], len(found) > most
