"""A scheduler of Dask, by its executor for `concurrent.futures`; workers get the tasks with all their texts.

Dask gives up a task when several workers died that had it, also where it waited behind the one that ends them. So each
that was given up is tried again at the end, when nothing else is under way.
"""

from __future__ import annotations

import logging
import pickle
import platform
import threading
import time
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeVar
from urllib.parse import urlsplit

from distributed import Client, KilledWorker

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.cluster import codes
from llfsm_verify.extensions.cluster.worker import PACKAGES, PERFORM, versions
from llfsm_verify.plug import LostTask

T = TypeVar("T")
R = TypeVar("R")
ANSWER, WORKERS = 10.0, 30.0
"""Seconds in which a scheduler answers, and in which a worker comes."""
AHEAD = 2
"""Tasks a thread of a worker that the scheduler has."""
TLS = "DASK_DISTRIBUTED__COMM__TLS__"
LOOK = 1.0
"""Seconds between two looks at the scheduler."""
RESUME = "what was done is kept: the same sweep, with the same results file, goes on from there"


class Cluster:
    """A scheduler of Dask at an address; how many workers it has is not decided here.

    DiagnosticError: it is not there (E600, E604), has no workers (E601), or one has other versions (E602).
    """

    def __init__(self, address: str, workers: int | None = None) -> None:  # noqa: ARG002 - as every scheduler
        self.address = address
        self._logger = logging.getLogger("distributed.client")
        self._level = self._logger.level
        _check_address(address)
        self._logger.setLevel(logging.CRITICAL)  # what it says is said here
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about versions, which are compared here
                self._client = _connected(address)
        except Exception as error:  # noqa: BLE001 - whatever answers there, or does not
            self._logger.setLevel(self._level)
            why = " ".join(str(error).split())[:200] or "what answers is not a scheduler"
            hint = "start it with `dask scheduler`, and look whether the address is the one that it prints"
            if address.startswith("tls:") and "TLS" in why:
                hint = f"name certificates in Dask's configuration: {TLS}CA_FILE, {TLS}CLIENT__CERT, {TLS}CLIENT__KEY"
            raise _error(codes.ABSENT, f"no scheduler answers at {address}: {why}", hint) from None
        try:
            self._wait_for_workers()
            self._compare()
        except BaseException:
            self.close()
            raise

    def run(self, call: Callable[[T], R], tasks: Iterable[T], ended: Callable[[T, R | LostTask], None]) -> None:
        """See `Scheduler`. E603: the scheduler is gone; E602, E601: as at the beginning, of workers that came later."""
        executor = self._client.get_executor(pure=False)
        running: dict[Future[R], T] = {}
        waiting, ours = iter(tasks), versions()
        suspects: list[T] = []
        alone: Future[R] | None = None

        def submit(task: T) -> Future[R]:
            names = {"wanted": ours, "work": pickle.dumps((call, task))}
            future: Future[R] = executor.submit(eval, PERFORM, names)
            running[future] = task
            return future

        most, looked, some = 0, -LOOK, time.monotonic()
        try:
            while True:
                if time.monotonic() - looked > LOOK:
                    most, looked = AHEAD * self._threads(), time.monotonic()
                    some = looked if most else some
                    if looked - some > WORKERS:
                        raise self._idle()
                while len(running) < most:
                    try:
                        task = next(waiting)
                    except StopIteration:
                        break
                    submit(task)
                if most and not running:
                    if not suspects:
                        return
                    alone = submit(suspects.pop())
                if not running:
                    time.sleep(LOOK / 10)  # until there are workers again
                for future in wait(running, LOOK, FIRST_COMPLETED).done:
                    found, task = self._end_of(future), running.pop(future)
                    if isinstance(found, LostTask) and future is not alone:
                        suspects.append(task)  # or what else its workers had to do
                    else:
                        ended(task, found)
        except (KeyboardInterrupt, SystemExit, DiagnosticError):
            for future, task in running.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    ended(task, future.result())
            raise
        finally:
            executor.shutdown(wait=False)  # which cancels what is under way

    def close(self) -> None:
        """See `Scheduler`."""
        connected = self._client.status == "running"
        with suppress(Exception):
            self._client.close(timeout=ANSWER if connected else 0.1)
        if connected:  # else it goes on in a thread, and has more to say
            self._logger.setLevel(self._level)

    def _end_of(self, future: Future[R]) -> R | LostTask:
        if future.cancelled():
            raise self._gone("our tasks were cancelled there")
        error = future.exception()
        if error is None:
            return future.result()
        if isinstance(error, KilledWorker):
            return LostTask(f"several workers tried it, and each died: {error.last_worker.address} was the last")
        self._compare()
        said = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        hint = f"install the same llfsm-verify there as here, {version(PACKAGES[0])}; {RESUME}"
        raise _error(codes.OTHER, f"a worker of {self.address} cannot perform our tasks ({said})", hint)

    def _threads(self) -> int:
        """Those of all workers that there are now. E603."""
        if self._client.status == "running":
            with suppress(Exception):
                return sum(self._client.nthreads().values())
        raise self._gone("the connection to it was lost")

    def _wait_for_workers(self) -> None:
        ends = time.monotonic() + WORKERS
        while not self._threads():
            if time.monotonic() > ends:
                raise self._idle()
            time.sleep(0.1)

    def _compare(self) -> None:
        """E602: a worker has other versions."""
        asked: list[tuple[str, Callable[..., object], tuple[object, ...]]] = [("Python", platform.python_version, ())]
        asked += [(name, version, (name,)) for name in PACKAGES]
        for (name, call, words), ours in zip(asked, versions(), strict=True):
            for worker, found in self._client.run(call, *words, on_error="return").items():
                if isinstance(found, PackageNotFoundError):
                    theirs = f"has no {name}"
                elif (
                    isinstance(found, str) and found != ours and not (name == "Python" and found.startswith(f"{ours}."))
                ):
                    theirs = f"has {name} {found}"
                else:
                    continue  # it is the same, or has died meanwhile
                hint = "install the same versions on all workers, and start them again"
                raise _error(codes.OTHER, f"the worker {worker} {theirs}, and here is {ours or 'none'}", hint)

    def _idle(self) -> DiagnosticError:
        hint = f"start some with `dask worker {self.address} --nthreads 1`"
        return _error(codes.IDLE, f"the scheduler at {self.address} has had no workers for {WORKERS:g} s", hint)

    def _gone(self, why: str) -> DiagnosticError:
        return _error(codes.GONE, f"the scheduler at {self.address} is gone: {why}", RESUME)


def _connected(address: str) -> Any:
    """A client. TimeoutError: something else listens there, to which Dask listens without end."""
    found: Future[Any] = Future()

    def connect() -> None:
        try:
            found.set_result(Client(address, timeout=ANSWER, set_as_default=False))
        except BaseException as error:  # noqa: BLE001 - raised in the other thread
            found.set_exception(error)

    threading.Thread(target=connect, daemon=True).start()
    return found.result(2 * ANSWER)


def _error(code: str, message: str, hint: str) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, hint=hint))


def _check_address(address: str) -> None:
    """E604."""
    try:
        parts = urlsplit(address)
        fine = bool(parts.hostname and parts.port) and not (parts.path.strip("/") or parts.query or parts.username)
    except ValueError:
        fine = False
    if not fine:
        hint = f"write it as `{address.partition(':')[0]}://HOST:8786`"
        raise _error(codes.ADDRESS, f"`{address[:100]}` is not the address of a scheduler", hint)
