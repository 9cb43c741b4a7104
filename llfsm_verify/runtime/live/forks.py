"""Processes that are forked for a run, and what one that the user's program forks must not keep of it.

A copy of the pipe by whose end the loop learns that its supervisor has died would keep the loop going, and a copy of
the socket of a whiteboard would let callers wait for an answer.
"""

from __future__ import annotations

import os
import select
import signal
import warnings
from collections.abc import Callable, Collection
from contextlib import suppress
from itertools import pairwise
from typing import Protocol
from weakref import WeakSet

from llfsm_verify.runtime.live import signals


class Kept(Protocol):
    """Something of a run that belongs to one process alone."""

    def let_go(self) -> None:
        """This process is a child of the one that it belongs to: close its descriptors, and nothing else."""


_kept: WeakSet[Kept] = WeakSet()


def keep(one: Kept) -> None:
    """Let a child of this process let go of it."""
    _kept.add(one)


def _forked() -> None:
    for one in list(_kept):
        with suppress(OSError):  # it was just about to be closed
            one.let_go()
    _kept.clear()


os.register_at_fork(after_in_child=_forked)


class Lifeline:
    """Tells forked processes that this one has died, or runs another program: the end of a pipe, and of the process.

    A child that is forked where Python does not see it keeps its copy of the pipe, so the pipe alone would not do.
    """

    def __init__(self) -> None:
        self._ends, self._held = os.pipe()
        self._process = os.pidfd_open(os.getpid())
        self.descriptors = {self._ends, self._process}
        """What a forked process needs of it."""

    def wait(self, others: tuple[int, ...] = (), milliseconds: int | None = None) -> set[int]:
        """In a forked process: wait until it has ended, or one of the others is readable, at most so long; which."""
        return readable((*self.descriptors, *others), milliseconds)

    def forked(self) -> None:
        """All processes that need it have been forked."""
        os.close(self._ends)
        os.close(self._process)

    def close(self) -> None:
        """It ends."""
        os.close(self._held)


class Child:
    """A process that was forked for a run, known by a descriptor: its number may be that of another one later."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._process = os.pidfd_open(pid)

    def end(self) -> int:
        """Kill it, if it lives, and wait for it; the signal that ended it; 0: no signal did, or it is not known."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._process, signal.SIGKILL)
        try:
            ended = os.waitid(os.P_PIDFD, self._process, os.WEXITED)
        except ChildProcessError:
            ended = None
        self.let_go()
        return ended.si_status if ended is not None and ended.si_code in (os.CLD_KILLED, os.CLD_DUMPED) else 0

    def let_go(self) -> None:
        """See `Kept`."""
        os.close(self._process)


def child(work: Callable[[], object], kept: set[int]) -> Child:
    """A process that does this and ends: it has no descriptors but these and the standard streams, and leaves signals
    to this process. Its exit code is 0, or 1 where the work fails.
    """
    with signals.held_back():
        pid = fork()
        if not pid:
            status = 1
            try:
                signals.ignore()
                signals.released()
                close_but({0, 1, 2, *kept})
                work()
                status = 0
            finally:
                os._exit(status)
    return Child(pid)


def readable(descriptors: Collection[int], milliseconds: float | None = None) -> set[int]:
    """Wait until one of these is readable, at most so long; which."""
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, select.POLLIN)
    return {descriptor for descriptor, _ in poll.poll(milliseconds)}


def fork() -> int:
    """As `os.fork`. Of several threads only this one goes on in the new process, which then does only what it was
    forked for, so Python's warning is left out.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def close_but(kept: set[int]) -> None:
    """Close all descriptors of this process but some: others shall see when their owner closes them."""
    most = os.sysconf("SC_OPEN_MAX")
    for low, high in pairwise([-1, *sorted(kept), most if most > 0 else 1 << 20]):
        if low + 1 < high:  # `closerange(0, 0)` closes all
            os.closerange(low + 1, high)
