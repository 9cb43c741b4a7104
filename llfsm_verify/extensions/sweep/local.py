"""Processes of this machine that perform tasks, by `concurrent.futures`; they end with the one that started them.

A process that a task ends (a crash, a kill by the system) ends the pool. The tasks that were under way are then
performed one by one, each alone in a pool, so that only the one that does it again is lost.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.sweep.codes import NO_PROCESS
from llfsm_verify.plug import LostTask

T = TypeVar("T")
R = TypeVar("R")
AHEAD = 2
"""Tasks a worker that are under way or wait for it: it never waits for the next one."""
RENEWED = 500
"""Tasks a worker after which all begin anew: what leaks is given back."""


def processors() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Processes:
    """A scheduler of so many processes (None: as many as processors). `address` says nothing."""

    def __init__(self, address: str = "", workers: int | None = None) -> None:  # noqa: ARG002 - as every scheduler
        self.workers = processors() if workers is None else workers
        self.renewed = RENEWED
        with _said():
            self._folder = tempfile.TemporaryDirectory(prefix="llfsm-sweep-", ignore_cleanup_errors=True)
        self._pool: _Pool | None = None

    def run(self, call: Callable[[T], R], tasks: Iterable[T], ended: Callable[[T, R | LostTask], None]) -> None:
        """See `Scheduler`."""
        running: dict[Future[R], T] = {}
        waiting = iter(tasks)
        told: list[Future[R]] = []
        try:
            while True:
                with _said():
                    pool = self._pool = self._pool or _Pool(call, self.workers, self._folder.name)
                most = self.renewed * self.workers
                while pool.submitted < most and len(running) < AHEAD * self.workers:
                    try:
                        task = next(waiting)
                    except StopIteration:
                        break
                    running[pool.submit(call, task)] = task
                if not running and pool.submitted < most:
                    return
                if not running:
                    self._end_pool()
                    continue
                suspects = []
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    if isinstance(future.exception(), BrokenProcessPool):
                        suspects.append(running.pop(future))
                        continue
                    told.append(future)
                    ended(running[future], future.result())
                    del running[future]
                    told.clear()
                if suspects:
                    suspects += self._abandoned(running, ended)
                    for task in suspects:
                        ended(task, self._alone(call, task))
        except (KeyboardInterrupt, SystemExit):
            for future, task in running.items():
                if future not in told and future.done() and not future.cancelled() and future.exception() is None:
                    ended(task, future.result())
            raise
        finally:
            if running:  # given up
                self._end_pool()

    def close(self) -> None:
        """See `Scheduler`."""
        self._end_pool()
        self._folder.cleanup()

    def _end_pool(self) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.end()

    def _abandoned(self, running: dict[Future[R], T], ended: Callable[[T, R | LostTask], None]) -> list[T]:
        """What else was under way in a pool that broke; what was done is told."""
        self._end_pool()
        left = []
        while running:
            future, task = running.popitem()
            if future.exception() is None:
                ended(task, future.result())
            else:
                left.append(task)
        return left

    def _alone(self, call: Callable[[T], R], task: T) -> R | LostTask:
        """What comes of a task that has a process of its own."""
        pool, started = _Pool(call, 1, self._folder.name), time.monotonic()
        try:
            return pool.submit(call, task).result()
        except BrokenProcessPool:
            return LostTask("the process that performed it ended before it", time.monotonic() - started)
        finally:
            pool.end()


class _Pool:
    """Processes, and the leash that they end with: a pipe, of which nobody but us has the end to write."""

    def __init__(self, call: Callable[..., object], workers: int, folder: str) -> None:
        method = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
        context = multiprocessing.get_context(method)
        if method == "forkserver":
            context.set_forkserver_preload([call.__module__])
        Path(folder).mkdir(exist_ok=True)
        self.submitted = 0
        self._leashed, self._leash = context.Pipe(duplex=False)
        self._executor = ProcessPoolExecutor(workers, context, _begin, (self._leashed, folder))

    def submit(self, call: Callable[[T], R], task: T) -> Future[R]:
        """As of an executor, which starts a process where none is free."""
        self.submitted += 1
        with _said(), _quiet_start():
            return self._executor.submit(call, task)

    def end(self) -> None:
        """End the processes, whatever they are doing, and wait for that."""
        self._leash.close()
        self._executor.shutdown(cancel_futures=True)
        self._leashed.close()


@contextmanager
def _said() -> Iterator[None]:
    """DiagnosticError (E598): the system does not let us start a process."""
    try:
        yield
    except OSError as error:
        hint = "take fewer --jobs, or raise the system's limits; what was done is kept"
        message = f"no process can be started: {error.strerror or error}"
        raise DiagnosticError(Diagnostic(NO_PROCESS, message, hint=hint)) from None


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Within, processes are started that never see Ctrl-C, which is served here alone, and that do not import the
    program again that we are part of: tasks do not need it."""
    main, blocked = sys.modules["__main__"], None
    if threading.current_thread() is threading.main_thread():
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        if blocked is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


def _begin(leash: Connection, folder: str) -> None:
    """What a process does first. Its temporary files are in `folder`, which nobody needs any more when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = folder

    def end() -> None:
        with suppress(EOFError, OSError):
            leash.recv_bytes()
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(0)

    threading.Thread(target=end, daemon=True).start()
