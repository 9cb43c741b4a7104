"""A run from its first frame to its last, on a thread of its own, and what it reports."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

from llfsm_verify.backends.native.executor import OVERFLOW
from llfsm_verify.program.program import FaultSite
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import CYCLE, DETAIL, MOVED
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.recording.file import Recorder

PERCENTILES = (50.0, 99.0, 99.9)


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late turns began, in nanoseconds."""

    turns: int
    percentiles: tuple[tuple[float, int], ...]
    """A percentile, and what so many per cent of the turns did not exceed (to an eighth of a power of two)."""
    worst: int
    overruns: int
    """Turns that were late by a period or more."""
    moved: int
    """By how much these moved the schedule."""


@dataclass(frozen=True, slots=True)
class RunReport:
    """How a run went."""

    ending: str
    """One of `live.frame.ENDINGS`."""
    fault: FaultSite | None
    """Why it ended, if it was a fault of the model."""
    frames: int
    cycles: int
    """Logical time."""
    ringlets: int
    seconds: float
    refused: int
    """Values from outside that were not of their slot's type."""
    lateness: Lateness | None
    """None: it did not wait."""
    priority: str | None = None
    """What the system granted."""
    unrecorded: str | None = None
    """Why the recording ended before the run."""
    recorded: int = 0
    """Frames that are in the recording, if there is one."""
    detail: int = 0
    """Of an ending: the number of the signal that stopped it, or of the one that killed a process."""
    monitored: tuple[tuple[str, str, int], ...] = ()
    """Of each monitor: its property, its verdict, and the number of the frame that decided it, or 0."""


class Running:
    """A loop on its way from its first frame to its last one, elsewhere: on a thread, or in processes.

    `priority` 1 to 99 asks for the system's first-in-first-out schedule (children of the process do not inherit it).
    """

    def __init__(self, loop: Loop, recorder: Recorder | None = None, *, priority: int | None = None) -> None:
        self.loop = loop
        loop.told[control.SETTLE] = bool(loop.code.monitors)
        self._recorder = recorder
        self._priority = priority
        self._ending = ("stopped", 0)
        self._granted: str | None = None
        self._unrecorded: str | None = None
        self._recorded = 0
        self._seconds = 0.0

    def stop(self, detail: int = 0) -> None:
        """Let it end after the cycle under way; `detail`: the number of the signal that asks for it."""
        self._ending = ("stopped", detail)
        self.loop.stop()

    def _prepared(self) -> None:
        """What the thread does that is going to drive the loop."""
        if self._priority is not None:
            self._granted = _ask_for(self._priority)

    def _drive(self) -> int:
        """Turns until there is a reason to return that others must know."""
        reason = control.FULL
        while reason in (control.FULL, control.DECIDED):
            if self.loop.heeds and "violated" in self.loop.verdicts:  # it may be so before the first turn
                return control.DECIDED
            reason = self.loop.go()
            if reason == control.DECIDED:
                self.loop.decide()
            if reason == control.FULL and self._recorder is not None:
                try:
                    self._recorder.grow()
                except OSError as error:
                    self._give_up_recording(error)
        return reason

    def _give_up_recording(self, error: OSError) -> None:
        self._unrecorded = error.strerror or "the file cannot grow"
        self._recorded = self.loop.number
        self.loop.told[control.LOG] = 0

    def _why(self, reason: int) -> tuple[str, int]:
        if reason == control.ENDED:
            return "ended", 0
        if reason == control.FAILED:
            return ("overflow" if self.loop.status == OVERFLOW else "fault"), self.loop.status
        if reason == control.OVERRUN:
            return "overrun", 0
        if reason == control.DECIDED:
            return "violated", 0
        return self._ending

    @property
    def report(self) -> RunReport:
        """How it went, after it has ended."""
        loop = self.loop
        told, frame = loop.told, loop.frame
        ending = loop.ending
        site = loop.code.program.faults[loop.status - 1] if ending == "fault" else None
        cycles = frame[CYCLE] + (loop.number > 2 or loop.steps > 0)
        return RunReport(
            ending, site, loop.number, cycles, loop.steps, self._seconds, told[control.REFUSED], lateness(loop),
            self._granted, self._unrecorded, loop.number if self._unrecorded is None else self._recorded,
            frame[DETAIL], tuple(zip(loop.code.monitors, loop.verdicts, loop.decided, strict=True)),
        )  # fmt: skip


class Run(Running):
    """A loop that runs on a thread of this process, until `stop`, its limit or an end of its own."""

    def __init__(self, loop: Loop, recorder: Recorder | None = None, *, priority: int | None = None) -> None:
        super().__init__(loop, recorder, priority=priority)
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded, name="llfsm-live")

    def start(self) -> None:
        """Let it run."""
        self._thread.start()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, at most so long; whether it has. Raises what ended its thread."""
        self._thread.join(seconds)
        if self._thread.is_alive():
            return False
        if self._error is not None:
            raise self._error
        return True

    def _guarded(self) -> None:
        try:
            self._prepared()
            begin = time.monotonic_ns()
            self.loop.begin(begin)
            self.loop.end(*self._why(self._drive()))
            self._seconds = (time.monotonic_ns() - begin) / 1e9
        except BaseException as error:  # noqa: BLE001 - raised again where somebody waits
            self._error = error
        finally:
            if self._recorder is not None:
                self._recorder.close()


def lateness(loop: Loop) -> Lateness | None:
    """How late the turns of a loop have begun so far; None: it does not wait."""
    told, counts = loop.told, list(loop.histogram)
    if not told[control.PERIOD]:
        return None
    return Lateness(sum(counts), percentiles(counts), told[control.WORST], told[control.OVERRUNS], loop.frame[MOVED])


def percentiles(counts: Sequence[int]) -> tuple[tuple[float, int], ...]:
    """For each of `PERCENTILES` the upper bound of the bucket in which it lies; none where nothing was counted."""
    total, found = sum(counts), []
    for percent in PERCENTILES if total else ():
        wanted, seen = total * percent / 100, 0
        for number, count in enumerate(counts):
            seen += count
            if seen >= wanted:
                found.append((percent, control.bucket_bounds(number)[1] - 1))
                break
    return tuple(found)


def _ask_for(priority: int) -> str:
    """Ask for a priority for this thread, and say what it got."""
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except OSError as error:
        return f"priority {priority} was not granted: {error.strerror}"
    return f"priority {priority} of SCHED_FIFO"
