"""A run from its first frame to its last, on a thread of its own, and what it reports."""

from __future__ import annotations

import os
import queue
import signal
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from llfsm_verify.backends.native.executor import OVERFLOW
from llfsm_verify.program.program import FaultSite
from llfsm_verify.runtime.live import control, forks
from llfsm_verify.runtime.live.control import words
from llfsm_verify.runtime.live.frame import CYCLE, DETAIL, ENDING, MOVED
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.protocols import FrameLog, Published

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
    never_visited: Mapping[str, tuple[str, ...]] | None = None
    """Of a simulation, by machine: the states in which it never was."""
    external: bool = False
    """Whether cycles began when a port said so."""


class Running(ABC):
    """A loop on its way from its first frame to its last one, elsewhere: on a thread, or in processes.

    `shared` is where the loop publishes its frames, if it does. `priority` 1 to 99 asks for the system's
    first-in-first-out schedule (children of the process do not inherit it). With `pace`, cycles begin from outside.
    """

    def __init__(
        self,
        loop: Loop,
        recorder: FrameLog | None = None,
        *,
        shared: Published | None = None,
        priority: int | None = None,
        pace: Pace | None = None,
    ) -> None:
        self.loop = loop
        self._pace = pace
        loop.control[control.UNTIL_SETTLED] = bool(loop.code.monitors)
        self.shared = shared
        self._recorder = recorder
        self._priority = priority
        self._ending = ("stopped", 0)
        self._began = words(1)
        """Monotonic nanoseconds at which the first frame was due."""
        self._hand_over: Callable[[], bool] | None = None
        self._stopping = False
        self.handed_over = False
        """Whether another run goes on with this one."""
        self._granted: str | None = None
        self._unrecorded: str | None = None
        self._recorded = 0
        self._seconds = 0.0

    def stop(self, detail: int = 0) -> None:
        """Let it end after the cycle under way; `detail`: the number of the signal that asks for it."""
        self._stopping = True
        self._ending = ("stopped", detail)
        self.loop.stop()

    @property
    def recordings(self) -> list[Path]:
        """The file of its recording, if there is one."""
        return [] if self._recorder is None else [self._recorder.path]

    @abstractmethod
    def start(self) -> None:
        """Let it run."""

    @abstractmethod
    def fileno(self) -> int:
        """Readable when `wait` has something to do."""

    @abstractmethod
    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, at most so long; whether it has. Raises what ended it, if that was an error."""

    def hand_over(self, to: Callable[[], bool]) -> None:
        """Let it pause after the cycle under way, and let `wait` call `to` then. True: another run goes on from here,
        so this one ends (`replaced`); False: it goes on.

        Where it ends for another reason, or is told to stop meanwhile, `to` is not called.
        """
        self._hand_over = to
        if not self._stopping:
            self.loop.control[control.STOP] = control.PAUSE
        if self._stopping:  # a signal came in between
            self.loop.stop()

    def take_over(self, before: Running) -> None:
        """Count the time of the run that this one goes on with."""
        self._began[0] = before._began[0]

    def _ends_here(self) -> bool:
        """It has paused: whether it ends there, or may go on."""
        to, self._hand_over = self._hand_over, None
        if to is not None and not self._stopping and to():
            self.handed_over = True
            return True
        self.loop.control[control.STOP] = 0
        if self._stopping:  # perhaps a signal came in between
            self.loop.stop()
        return False

    def _has_paused(self, reason: int) -> bool:
        return reason == control.TOLD and self.loop.control[control.STOP] == control.PAUSE

    def _count_time(self) -> None:
        self._seconds = (time.monotonic_ns() - self._began[0]) / 1e9 if self._began[0] else 0.0

    def __enter__(self) -> Self:
        return self

    @abstractmethod
    def __exit__(self, *_: object) -> None:
        """Ends what still runs: something went wrong here."""

    def _prepared(self) -> None:
        """What the thread does that is going to drive the loop."""
        if self._priority is not None:
            self._granted = _ask_for(self._priority)

    def _drive(self) -> int:
        """Turns until there is a reason to return that others must know."""
        reason = control.FULL
        while reason in (control.FULL, control.DECIDED) or (reason == control.DONE and self._pace is not None):
            if reason == control.DONE and self._pace is not None:
                self._pace.wait(self.loop)
            if self.loop.stops_on_violation and "violated" in self.loop.verdicts:  # it may be so before the first turn
                return control.DECIDED
            reason = self.loop.go()
            if reason == control.DECIDED:
                self.loop.decide()
            if reason == control.FULL and self._recorder is not None:
                try:
                    self._recorder.grow()
                except OSError as error:
                    self._give_up_recording(self._recorder, error)
        return reason

    def _give_up_recording(self, recorder: FrameLog, error: OSError) -> None:
        self._unrecorded = recorder.give_up(error)
        self._recorded = self.loop.number

    @property
    def _kept(self) -> set[int]:
        """Descriptors that a process needs which runs the loop, or ends it."""
        own = () if self.shared is None else self.shared.descriptors
        return {
            *own,
            *(() if self._pace is None else self._pace.descriptors),
            *([] if self._recorder is None else [self._recorder.fileno()]),
        }

    def _outlive(self, detail: int = signal.SIGKILL) -> None:
        """Commit the last frame where the loop does not run any more, unless it is there already. In a process that was
        forked for the run: the process that the run belongs to has died.
        """
        newest = self._newest
        if newest is not None and not newest[ENDING]:
            self.loop.resume(newest)
            self._reach()
            self.loop.end("died", detail)
        if self._recorder is not None:
            self._recorder.close()

    @property
    def _newest(self) -> list[int] | None:
        """The newest frame that was published; None: no frame was."""
        return None if self.shared is None else self.shared.segment.newest()

    def _reach(self) -> None:
        """Let the recording go on in this process."""
        if self._recorder is not None and self.loop.control[control.LOG]:
            try:
                self._recorder.reach()
            except OSError as error:
                self._give_up_recording(self._recorder, error)

    def _why(self, reason: int) -> tuple[str, int]:
        if self.handed_over:
            return "replaced", 0
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
        block, frame = loop.control, loop.frame
        ending = loop.ending
        site = loop.code.program.faults[loop.status - 1] if ending == "fault" else None
        cycles = frame[CYCLE] + (loop.number > 2 or loop.steps > 0)
        return RunReport(
            ending, site, loop.number, cycles, loop.steps, self._seconds, block[control.REFUSED], lateness(loop),
            self._granted, self._unrecorded, loop.number if self._unrecorded is None else self._recorded,
            frame[DETAIL], tuple(zip(loop.code.monitors, loop.verdicts, loop.decided, strict=True)), loop.never_visited,
            self._pace is not None,
        )  # fmt: skip


class Run(Running):
    """A loop that runs on a thread of this process, until `stop`, its limit or an end of its own.

    With `shared`, and where the last frame has something to say (safe values, or to a recording), a process is forked
    that commits it if this process dies.
    """

    def __init__(
        self,
        loop: Loop,
        recorder: FrameLog | None = None,
        *,
        shared: Published | None = None,
        priority: int | None = None,
        pace: Pace | None = None,
    ) -> None:
        super().__init__(loop, recorder, shared=shared, priority=priority, pace=pace)
        self._guardian: tuple[forks.Lifeline, forks.Child] | None = None
        """The process that outlives this one, if there is one."""
        if shared is not None and (loop.code.safe or recorder is not None):
            self._fork()
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded, name="llfsm-live", daemon=True)
        self._news = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
        """Written when the thread has paused, or is over."""
        self._pausing = False
        self._answers: queue.SimpleQueue[bool] = queue.SimpleQueue()
        """For the thread that has paused: whether it goes on."""
        self._over = False

    def _fork(self) -> None:
        lifeline = forks.Lifeline()

        def guard() -> None:
            lifeline.wait()  # until this process has died, or ends its child
            self._outlive()

        self._guardian = lifeline, forks.child(guard, lifeline.descriptors | self._kept)
        lifeline.forked()
        forks.keep(self)

    def let_go(self) -> None:
        """See `forks.Kept`."""
        if self._guardian is not None:
            (lifeline, child), self._guardian = self._guardian, None
            lifeline.close()
            child.let_go()

    def start(self) -> None:
        """Let it run."""
        self._thread.start()

    def fileno(self) -> int:
        """See `Running`."""
        return self._news

    def wait(self, seconds: float | None = None) -> bool:
        """See `Running`."""
        if not self._over:
            if not forks.readable((self._news,), None if seconds is None else 1000 * seconds):
                return False
            os.eventfd_read(self._news)
            if self._pausing:
                self._pausing = False
                ends = self._ends_here()
                self._answers.put(not ends)
                if not ends:
                    return False
            self._finish()
        if self._error is not None:
            raise self._error
        return True

    def _finish(self) -> None:
        if self._thread.ident is not None:
            self._thread.join()
        self._over = True
        os.close(self._news)
        if self._guardian is not None:
            (lifeline, child), self._guardian = self._guardian, None
            child.end()
            lifeline.close()

    def __exit__(self, *_: object) -> None:
        """See `Running`."""
        if self._over:
            return
        if self._thread.ident is not None:
            self.stop()
            self._answers.put(True)  # should it have paused
        elif self._recorder is not None:
            self._recorder.close()
        self._finish()

    # ------------------------------------------------------------ on its thread

    def _guarded(self) -> None:
        try:
            self._prepared()
            if not self.loop.number:
                self._began[0] = time.monotonic_ns()
                self.loop.begin(self._began[0])
            reason = self._drive()
            while self._has_paused(reason) and self._goes_on():
                reason = self._drive()
            self.loop.end(*self._why(reason))
            self._count_time()
        except BaseException as error:  # noqa: BLE001 - raised again in `wait`
            self._error = error
        finally:
            if self._recorder is not None:
                self._recorder.close()
            os.eventfd_write(self._news, 1)

    def _goes_on(self) -> bool:
        """Pause, until `wait` has decided it."""
        self._pausing = True
        os.eventfd_write(self._news, 1)
        return self._answers.get()


def lateness(loop: Loop) -> Lateness | None:
    """How late the turns of a loop have begun so far; None: it does not wait."""
    block, counts = loop.control, list(loop.histogram)
    if not block[control.PERIOD]:
        return None
    return Lateness(sum(counts), percentiles(counts), block[control.WORST], block[control.OVERRUNS], loop.frame[MOVED])


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
