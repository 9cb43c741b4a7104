"""What signals do to a run: in the process that supervises it, and in those that are forked for it.

`docs/safety.md` has the table. A signal that would end a process by default ends the run instead, so that outputs get
their safe values; processes that were forked leave it to the supervisor. Signals that report a mistake of the process
itself (such as SIGSEGV), SIGKILL and SIGSTOP are left as they are: the process that is left commits the last frame.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from signal import Signals
from types import FrameType

LEFT = frozenset(
    {Signals.SIGKILL, Signals.SIGSTOP, Signals.SIGCONT, Signals.SIGCHLD, Signals.SIGWINCH, Signals.SIGURG}
    | {
        Signals.SIGSEGV,
        Signals.SIGBUS,
        Signals.SIGFPE,
        Signals.SIGILL,
        Signals.SIGABRT,
        Signals.SIGTRAP,
        Signals.SIGSYS,
    }
)
"""Signals that a run does nothing about: they cannot be caught, report a mistake, or do nothing by themselves."""
UNHEARD = frozenset({Signals.SIGTTIN, Signals.SIGTTOU, Signals.SIGPIPE, Signals.SIGXFSZ})
"""Signals that tell of a read or write that fails, which is then said where it is done."""
ASKING = frozenset({Signals.SIGINT, Signals.SIGTERM, Signals.SIGHUP, Signals.SIGQUIT, Signals.SIGTSTP})
"""Signals by which people and the system ask for an end. A handler of the program is replaced for the run."""


def ignore() -> None:
    """Leave all signals of this process, which was forked for a run, to its supervisor."""
    for number in signal.valid_signals() - LEFT:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def held_back() -> Iterator[None]:
    """No signal is served meanwhile. A process that is forked meanwhile serves none until `released`."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals() - LEFT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def released() -> None:
    """Serve signals again in a process that was forked while they were held back."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())


@contextmanager
def stopping(stop: Callable[[int], None]) -> Iterator[Callable[[], bool]]:
    """Each signal that would end or suspend this process calls `stop` with its number, but where it is ignored already.

    Gives a function that says whether SIGTSTP was among them: the process shall be suspended when all is safe. On
    another thread than the main one, nothing is changed.
    """
    suspended = False

    def serve(number: int, _: FrameType | None) -> None:
        nonlocal suspended
        suspended = suspended or number == signal.SIGTSTP
        stop(number)

    before = {}
    try:
        if threading.current_thread() is threading.main_thread():
            for number in signal.valid_signals() - LEFT:
                handler = signal.getsignal(number)
                if handler is signal.SIG_DFL or (number in ASKING and handler is not signal.SIG_IGN):
                    before[number] = signal.signal(number, signal.SIG_IGN if number in UNHEARD else serve)
        yield lambda: suspended
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
