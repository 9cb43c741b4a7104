"""Several pieces of work at a time, each in a fork of this process; what they print comes in their order."""

from __future__ import annotations

import os
import selectors
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from llfsm_verify.interrupts import deferring
from llfsm_verify.kept import keep_waiting
from llfsm_verify.runtime.live.forks import fork

GRACE = 10.0
"""Seconds in which work that is interrupted may say what it has found."""
INTERRUPTED, BROKEN = 130, 70
"""Exit codes of work that is interrupted before it says anything, and of work that raises what it should not."""
PORTION = 1 << 16


@dataclass(slots=True)
class Done:
    """A piece of work that has ended: its exit code, or minus the signal that ended it, and its standard output."""

    number: int
    code: int
    said: str


@dataclass(slots=True)
class _Fork:
    process: int
    streams: dict[int, bytearray]
    """What has come of standard output and standard error, by the ends of pipes that are read."""
    open: set[int] = field(default_factory=set)
    code: int | None = None
    """Once it has ended."""


class Forks:
    """Forks of this process that do `work(0)` … `work(count - 1)`, `jobs` at a time. They end when this one does."""

    def __init__(self, count: int, jobs: int, work: Callable[[int], int]) -> None:
        self._count, self._jobs, self._work = count, jobs, work
        self._forks: list[_Fork] = []
        self._selector = selectors.DefaultSelector()
        self._alive = os.pipe()
        self._deadline: float | None = None

    def results(self) -> Iterator[Done]:
        """Each as soon as it and all before it have ended; its standard error is passed on at once when it is next.

        Ctrl-C interrupts all at work, begins no more, and is raised again when those have been given.
        """
        interrupted = False
        try:
            for number in range(self._count):
                while number >= len(self._forks) or self._forks[number].code is None:
                    try:
                        while not interrupted and len(self._forks) < self._count and self._at_work < self._jobs:
                            ends = self._begin()
                            if ends is not None:
                                self._serve(len(self._forks), *ends)
                        if number >= len(self._forks):
                            raise KeyboardInterrupt
                        self._take(self._selector.select(0.5), number)
                    except KeyboardInterrupt:
                        if interrupted:
                            raise
                        interrupted = True
                        self._deadline = time.monotonic() + GRACE
                        self._signal(signal.SIGINT)
                self._pass_on(number)
                found = self._forks[number]
                assert found.code is not None
                yield Done(number, found.code, next(iter(found.streams.values())).decode("utf-8", "replace"))
        finally:
            self._signal(signal.SIGKILL)
            self._close()
        if interrupted:
            raise KeyboardInterrupt

    @property
    def _at_work(self) -> int:
        return sum(each.code is None for each in self._forks)

    @deferring
    def _begin(self) -> tuple[int, int] | None:
        """Fork; in the fork: its ends of the pipes."""
        pipes = [os.pipe(), os.pipe()]
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # the fork ends with its work, whatever comes
        process = fork()
        if process == 0:
            return pipes[0][1], pipes[1][1]
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        for _, end in pipes:
            os.close(end)
        ends = [end for end, _ in pipes]
        made = _Fork(process, {end: bytearray() for end in ends}, set(ends))
        self._forks.append(made)
        for end in ends:
            self._selector.register(end, selectors.EVENT_READ, made)
        return None

    def _serve(self, number: int, out: int, error: int) -> NoReturn:
        """Do the work, in a fork: in a group of its own, so that Ctrl-C on a terminal reaches it once, by `_signal`."""
        code = BROKEN
        try:
            os.setpgid(0, 0)
            os.close(self._alive[1])
            threading.Thread(target=self._end_with_the_parent, daemon=True).start()
            for end, place in ((out, 1), (error, 2)):
                os.dup2(end, place)
                os.close(end)
            self._kept = sys.stdout, sys.stderr  # what stands for closed ones closes its file where it is given up
            sys.stdout = open(1, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
            sys.stderr = open(2, "w", 1, encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            code = self._work(number)
            keep_waiting()
        except KeyboardInterrupt:
            code = INTERRUPTED
        finally:
            sys.stdout.flush()
            os._exit(code)

    def _end_with_the_parent(self) -> None:
        os.read(self._alive[0], 1)
        os._exit(BROKEN)

    @deferring
    def _take(self, ready: list[tuple[selectors.SelectorKey, int]], number: int) -> None:
        """Take what has come; standard error of work `number` is passed on."""
        for key, _ in ready:
            fork: _Fork = key.data
            end = key.fd
            text = os.read(end, PORTION)
            fork.streams[end] += text
            if not text:
                self._selector.unregister(end)
                os.close(end)
                fork.open.remove(end)
                if not fork.open:
                    fork.code = os.waitstatus_to_exitcode(os.waitpid(fork.process, 0)[1])
        self._pass_on(number)
        if self._deadline is not None and time.monotonic() > self._deadline:
            self._signal(signal.SIGKILL)

    def _pass_on(self, number: int) -> None:
        """What has come of its standard error."""
        errors = list(self._forks[number].streams.values())[1]
        whole = len(errors) if self._forks[number].code is not None else errors.rfind(b"\n") + 1
        if whole:
            sys.stderr.write(errors[:whole].decode("utf-8", "replace"))
            sys.stderr.flush()
            del errors[:whole]

    def _signal(self, number: signal.Signals) -> None:
        for each in self._forks:
            if each.code is None:
                os.kill(each.process, number)

    @deferring
    def _close(self) -> None:
        for each in self._forks:
            if each.code is None:
                os.waitpid(each.process, 0)
            for end in each.open:
                os.close(end)
        self._selector.close()
        for end in self._alive:
            os.close(end)
