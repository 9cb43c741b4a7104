"""Ways to stop an engine at work: its budget raises, Ctrl-C comes, or its time is over."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from llfsm_verify.interrupts import SOON, waits
from llfsm_verify.limits import Budget, Limits


class Overdue(BaseException):
    """Nobody but the suite catches it."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Raises Overdue in the block after so much processor time, and then again and again.

    Only in the main thread, where Python serves signals; elsewhere nothing ends the block.
    """
    with _alarm(signal.ITIMER_PROF, signal.SIGPROF, seconds, Overdue()):
        yield


@contextmanager
def interrupted(seconds: float) -> Iterator[list[BaseException]]:
    """Ctrl-C in the block after so much processor time, and then every second of it; the list has what was raised.
    Only in the main thread."""
    with _alarm(signal.ITIMER_VIRTUAL, signal.SIGVTALRM, seconds, KeyboardInterrupt()) as raised:
        yield raised


@contextmanager
def _alarm(timer: int, number: signal.Signals, seconds: float, error: BaseException) -> Iterator[list[BaseException]]:
    raised: list[BaseException] = []
    if threading.current_thread() is not threading.main_thread():
        yield raised
        return

    def ring(_number: int, frame: FrameType | None) -> None:
        if waits(frame):
            signal.setitimer(timer, SOON, 1.0)
        else:
            raised.append(error)
            raise error

    before = signal.signal(number, ring)
    signal.setitimer(timer, seconds, 1.0)
    try:
        yield raised
    finally:
        signal.setitimer(timer, 0)
        signal.signal(number, before)


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
