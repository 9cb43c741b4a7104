"""The cycles of a run, counted from 1, and the logical time at which each begins."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from llfsm_verify.checking.trace import TraceStep

MOST_DECIMALS = 6
SECOND = 1000
"""Milliseconds."""


class Moment(NamedTuple):
    """When a step was: the cycle of its process, and whether it is the first step of that cycle."""

    cycle: int
    begins: bool


class Cycles:
    """Counts cycles, step by step; each process counts its own. After the end each repetition is a cycle."""

    def __init__(self) -> None:
        self._done: dict[str | None, int] = {}
        self._begun: set[str | None] = set()

    def moment(self, step: TraceStep) -> Moment:
        """When the next step is."""
        process = step.process
        if process is None:
            ended = max(self._done.values(), default=0) + 1
            self._done[None] = ended
            return Moment(ended, begins=True)
        begins = process not in self._begun
        moment = Moment(self._done.get(process, 0) + 1, begins)
        self._begun.add(process)
        if step.cycle:
            self._begun.remove(process)
            self._done[process] = moment.cycle
        return moment


def moments(steps: Iterable[TraceStep]) -> list[Moment]:
    """When each step of a run was."""
    cycles = Cycles()
    return [cycles.moment(step) for step in steps]


@dataclass(frozen=True, slots=True)
class Times:
    """Writes the logical time at which a cycle begins, with the same unit and number of decimals in a whole table."""

    period: Fraction | None
    unit: str
    size: int
    decimals: int

    @staticmethod
    def until(period: Fraction | None, last: int) -> Times:
        """For a table that goes as far as the cycle `last`."""
        if period is None:
            return Times(None, "", 1, 0)
        unit, size = ("s", SECOND) if period * (last - 1) >= SECOND else ("ms", 1)
        scaled = period / size
        decimals = next((n for n in range(MOST_DECIMALS) if (scaled * 10**n).denominator == 1), MOST_DECIMALS)
        return Times(period, unit, size, decimals)

    def of(self, first: int, last: int) -> str:
        """When the first cycle begins, and the last one where that is another; nothing in an untimed arrangement."""
        if self.period is None:
            return ""
        begin = self._number(first)
        return f"{begin} {self.unit}" if first == last else f"{begin}–{self._number(last)} {self.unit}"

    def _number(self, cycle: int) -> str:
        assert self.period is not None
        return f"{float(self.period * (cycle - 1) / self.size):.{self.decimals}f}"


def cycles_text(first: int, last: int) -> str:
    """`3`, or `3–7`."""
    return str(first) if first == last else f"{first}–{last}"
