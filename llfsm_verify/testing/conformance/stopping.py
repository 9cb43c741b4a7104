"""Ways to stop an engine at work: its budget raises, Ctrl-C comes, or its time is over."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType

from llfsm_verify.interrupts import SOON, deferring, waits
from llfsm_verify.limits import Budget, Limits


class Overdue(BaseException):
    """Only the suite catches it."""


class Alarm:
    """Raises an error in one block after so much time of a timer, and then every second of it.

    It waits where the error would be lost or break something, and comes again when Python has forgotten it all the
    same. Only in the main thread, where Python serves signals; elsewhere nothing is raised. Blocks with the same timer
    cannot be inside each other.
    """

    def __init__(self, timer: int, number: signal.Signals, seconds: float, error: BaseException) -> None:
        self._timer = timer
        self._number = number
        self._seconds = seconds
        self._error = error
        self._raised: list[BaseException] = []
        self._block: FrameType | None = None
        """The function with the block, as long as it is in the block."""

    @deferring
    def __enter__(self) -> list[BaseException]:
        """The list of what was raised, which grows."""
        if threading.current_thread() is threading.main_thread():
            self._block = sys._getframe(1)
            self._hook = sys.unraisablehook
            self._handler = signal.signal(self._number, self._ring)
            self._before = signal.getitimer(self._timer)
            sys.unraisablehook = self._forgotten
            self._again(self._seconds)
        return self._raised

    @deferring
    def __exit__(self, *_: object) -> None:
        if self._block is not None:
            self._end()

    def _end(self) -> None:
        self._block = None
        signal.setitimer(self._timer, 0)
        signal.signal(self._number, self._handler)
        signal.setitimer(self._timer, *self._before)  # whoever waits for it gets it later
        sys.unraisablehook = self._hook

    def _again(self, seconds: float) -> None:
        signal.setitimer(self._timer, seconds, 1.0)

    def _ring(self, _number: int, frame: FrameType | None) -> None:
        if self._block is None:
            return
        if not _inside(frame, self._block):  # another signal's exception has left the block, before `__exit__` began
            self._end()
        elif waits(frame):
            self._again(SOON)
        else:
            self._raised.append(self._error)
            raise self._error

    @deferring
    def _forgotten(self, unraisable: sys.UnraisableHookArgs) -> None:
        if unraisable.exc_value is not self._error:
            self._hook(unraisable)
        elif self._block is not None:
            self._raised.pop()
            self._again(SOON)


def _inside(frame: FrameType | None, block: FrameType) -> bool:
    while frame is not None and frame is not block:
        frame = frame.f_back
    return frame is block


def within(seconds: float) -> Alarm:
    """Raises Overdue in the block after so much processor time, and then again and again."""
    return Alarm(signal.ITIMER_PROF, signal.SIGPROF, seconds, Overdue())


def within_time(seconds: float) -> Alarm:
    """The same, by wall-clock time."""
    return Alarm(signal.ITIMER_REAL, signal.SIGALRM, seconds, Overdue())


def interrupted(seconds: float) -> Alarm:
    """Ctrl-C in the block after so much processor time, and then every second of it."""
    return Alarm(signal.ITIMER_VIRTUAL, signal.SIGVTALRM, seconds, KeyboardInterrupt())


class StoppingBudget(Budget):
    """A budget that is used up when it is asked for the time number `at`: it raises `error` then, and from then on.

    Ctrl-C it raises once. Only in the thread that made it.
    """

    def __init__(self, limits: Limits, at: int, error: BaseException) -> None:
        super().__init__(limits)
        self._at = at
        self._error = error
        self._thread = threading.get_ident()
        self._asked = [0]
        """Also by a part of the work (`narrowed`)."""
        self._ended = [False]

    @property
    def stopped(self) -> bool:
        """Whether it has raised."""
        return self._asked[0] >= self._at

    def end(self) -> None:
        """Raise nothing from now on."""
        self._ended[0] = True

    def tick(self) -> None:
        self._ask()
        super().tick()

    def check(self, more: int = 0) -> None:
        self._ask()
        super().check(more)

    def _ask(self) -> None:
        if self._ended[0] or threading.get_ident() != self._thread:
            return
        self._asked[0] += 1
        if self._asked[0] == self._at or (self.stopped and not isinstance(self._error, KeyboardInterrupt)):
            raise self._error
