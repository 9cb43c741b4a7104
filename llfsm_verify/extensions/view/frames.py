"""From frames of a whiteboard to rows of a page: what changed, fired, is marked, and how late cycles began."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

from llfsm_verify.extensions.view.values import Exact, exact
from llfsm_verify.plug import FRAME_ENDINGS, FRAME_HEADER, BoardSlot, Json

NUMBER, CYCLE, COMMITTED, LATENESS, MOVED, PROCESS, ENDING, STEPS = (
    FRAME_HEADER[name]
    for name in ("NUMBER", "CYCLE", "COMMITTED", "LATENESS", "MOVED", "PROCESS", "ENDING", "STEPS")
)  # fmt: skip
EDGES_US = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 50_000)


class Row(NamedTuple):
    """A frame of a run, as what it changes."""

    step: int
    cycle: int
    time_ms: float | None
    turn: int
    changed: tuple[tuple[int, Exact], ...]
    """Signals with their new values; of the first row all."""
    fired: tuple[tuple[int, int], ...]
    """Machines and their transitions."""
    marks: tuple[dict[str, Json], ...]
    missed: int
    """Frames before it that were overwritten before they were read."""
    skipped: int
    """Frames before it that were read and are not shown."""
    committed: int
    """Monotonic nanoseconds."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A machine of the document: its number there, its signal, and its transitions."""

    number: int
    signal: int
    transitions: Mapping[str, Sequence[tuple[int, str]]]
    """By the name of the source those of a state in their order, with their numbers in the document and targets."""
    fired: int | None
    """The word of a frame that says which transition of its state fired, from 1; 0: none did."""

    def transition(self, before: Exact, after: Exact, frame: Sequence[int]) -> int | None:
        """The number in the document of what fired between two frames that follow each other; None: nothing, or it
        cannot be known."""
        leaving = self.transitions.get(str(before), ())
        if self.fired is None:
            found = [number for number, target in leaving if target == after]
            return found[0] if len(found) == 1 and before != after else None
        number = frame[self.fired] if self.fired < len(frame) else 0
        if not 0 < number <= len(leaving) or leaving[number - 1][1] != after:
            return None  # an operator has moved it as well
        return leaving[number - 1][0]


@dataclass(slots=True)
class Latenesses:
    """How late the cycles began that were seen, as `llfsm run` counts them: at the first turn of each."""

    period: int
    """Nanoseconds; 0: it does not wait."""
    counts: list[int] = field(default_factory=lambda: [0] * (len(EDGES_US) + 1))
    worst: int = 0
    overruns: int = 0

    def count(self, frame: Sequence[int], before: Sequence[int]) -> None:
        """A frame, and the one that was read before it."""
        follows = frame[NUMBER] == before[NUMBER] + 1
        begins = frame[CYCLE] > before[CYCLE] and (follows or not frame[PROCESS])
        if not self.period or frame[ENDING] or not (begins or (before[PROCESS] < 0 and follows)):
            return
        late = frame[LATENESS]
        self.counts[bisect_left(EDGES_US, late / 1000)] += 1
        self.worst = max(self.worst, late)
        self.overruns += late >= self.period

    def shown(self) -> dict[str, Json] | None:
        """As the page has them."""
        if not self.period:
            return None
        return {
            "edges_us": list(EDGES_US), "counts": list(self.counts), "worst_us": self.worst / 1000,
            "overruns": self.overruns,
        }  # fmt: skip


class FrameReader:
    """Makes rows of the frames of one run, each of which it gets once, in their order.

    `turns`: of each process of the arrangement the number of its machine, if it has one only, else -1.
    """

    def __init__(
        self,
        slots: Sequence[BoardSlot],
        machines: Sequence[Drawn],
        *,
        period: float,
        cycle_ms: Fraction | None,
        turns: Sequence[int] = (),
    ) -> None:
        self._slots, self._machines, self._cycle_ms, self._turns = slots, machines, cycle_ms, turns
        self._readers = [slot.reader() for slot in slots]
        self.latenesses = Latenesses(round(period * 1e9))
        self._before: Sequence[int] | None = None
        """The frame that was read last."""
        self._shown: Sequence[int] | None = None
        """The frame of the last row."""
        self.processes = 1
        """So many take turns, as far as was seen."""
        self.values: list[Exact] = []
        """Of the last row."""
        self._skipped = 0

    @property
    def last(self) -> int:
        """The number of the frame that was read last; 0: none was."""
        return 0 if self._before is None else self._before[NUMBER]

    @property
    def verdicts(self) -> dict[str, str]:
        """Of monitors, by their properties."""
        pairs = zip(self._slots, self.values, strict=False)
        return {property_of(slot): str(value) for slot, value in pairs if slot.kind == "verdict"}

    def _read(self, frame: Sequence[int]) -> None:
        if self._before is not None:
            self.latenesses.count(frame, self._before)
        self.processes = max(self.processes, frame[PROCESS] + 1)
        self._before = frame

    def skip(self, frame: Sequence[int]) -> None:
        """A frame that is no row, but counts."""
        self._skipped += 1
        self._read(frame)

    def row(self, frame: Sequence[int]) -> Row:
        """A frame that is a row."""
        self._read(frame)
        shown, old = self._shown, self.values
        first = shown is None
        missed = 0 if shown is None else frame[NUMBER] - shown[NUMBER] - 1 - self._skipped
        changed: list[tuple[int, Exact]] = []
        new = list(old)
        for number, (slot, read) in enumerate(zip(self._slots, self._readers, strict=True)):
            if shown is None:
                new.append(exact(read(frame[slot.word])))
                changed.append((number, new[number]))
            elif frame[slot.word] != shown[slot.word]:
                value = exact(read(frame[slot.word]))
                if value != old[number]:
                    new[number] = value
                    changed.append((number, value))
        follows = shown is not None and frame[NUMBER] == shown[NUMBER] + 1 and not frame[ENDING]
        fired = self._fired(old, new, frame) if follows else ()
        marks = () if shown is None else tuple(self._marks(changed, old, frame[MOVED] - shown[MOVED], missed))
        cycle = frame[CYCLE] + (frame[NUMBER] > 1)
        time = None if self._cycle_ms is None else float(cycle * self._cycle_ms)
        turn = self._turns[frame[PROCESS]] if not frame[ENDING] and 0 <= frame[PROCESS] < len(self._turns) else -1
        skipped, self._skipped = self._skipped, 0
        self._shown = frame
        self.values = new
        return Row(
            frame[STEPS], cycle, time, -1 if first else turn, tuple(changed), fired, marks, missed, skipped,
            frame[COMMITTED],
        )  # fmt: skip

    def _fired(self, old: Sequence[Exact], new: Sequence[Exact], frame: Sequence[int]) -> tuple[tuple[int, int], ...]:
        found = ((m.number, m.transition(old[m.signal], new[m.signal], frame)) for m in self._machines)
        return tuple((number, transition) for number, transition in found if transition is not None)

    def _marks(
        self, changed: Sequence[tuple[int, Exact]], old: Sequence[Exact], moved: int, missed: int
    ) -> list[dict[str, Json]]:
        marks: list[dict[str, Json]] = []
        if missed:
            marks.append({"kind": "missed", "text": f"{missed:,} frames before this one were not read in time"})
        if moved > 0:
            said = f"the schedule moved by {moved / 1e6:.3f} ms, since a cycle began a whole cycle late"
            marks.append({"kind": "overrun", "text": said})
        for signal, value in changed:
            slot, kind = self._slots[signal], "event"
            if slot.kind == "state":
                said = f"{slot.name}: {old[signal]} -> {value}"
            elif slot.kind == "verdict":
                kind, said = "violation" if value == "violated" else "verdict", f"{value}: {property_of(slot)}"
            else:
                continue
            marks.append({"kind": kind, "text": said, "signals": [signal]})
        return marks


def property_of(slot: BoardSlot) -> str:
    """The property of a monitor's slot."""
    return slot.name.removeprefix("verdict(").removesuffix(")")


def ending_of(frame: Sequence[int], *, gone: bool) -> str:
    """Why there is no frame after this one, or `running`."""
    ending = FRAME_ENDINGS[frame[ENDING]] if 0 <= frame[ENDING] < len(FRAME_ENDINGS) else "died"
    return "died" if gone and ending == "running" else ending
