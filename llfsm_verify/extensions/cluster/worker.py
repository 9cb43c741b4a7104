"""What a worker of a cluster does with a task: it performs it, unless it is another version, until it is cancelled."""

from __future__ import annotations

import ctypes
import pickle
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("llfsm-verify", "llvmlite", "numba", "z3-solver")
"""What decides verdicts and machine code."""
LOOK = 0.2
"""Seconds between two looks whether a task is cancelled."""


PERFORM = f"__import__({__name__!r}, fromlist=['performed']).performed(wanted, work)"
"""What workers evaluate. A function of ours would end those that cannot import it, whatever else they are doing."""


class OtherVersion(Exception):
    """This worker has other versions."""


@cache
def versions() -> tuple[str, ...]:
    """Of Python, without its last part, and of `PACKAGES`; empty for what is not there."""
    found = [f"{sys.version_info.major}.{sys.version_info.minor}"]
    for name in PACKAGES:
        try:
            found.append(version(name))
        except PackageNotFoundError:
            found.append("")
    return tuple(found)


def performed(wanted: tuple[str, ...], work: bytes) -> object:
    """What the pickled `work`, a call and its task, gives; None: it was cancelled. OtherVersion: these are not the
    `wanted` versions."""
    if versions() != wanted:
        raise OtherVersion(versions())
    call, task = pickle.loads(work)  # noqa: S301 - who may give tasks to a worker may let it do anything
    lock, done, thread = threading.Lock(), threading.Event(), threading.get_ident()
    cancelled = _cancellation()

    def watch() -> None:
        while not done.wait(LOOK):
            with lock:
                if not done.is_set() and cancelled():
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(
                        ctypes.c_ulong(thread), ctypes.py_object(KeyboardInterrupt)
                    )
                    return

    threading.Thread(target=watch, daemon=True).start()
    try:
        try:
            return call(task)
        finally:
            with lock:
                done.set()
    except KeyboardInterrupt:
        return None


def _cancellation() -> Callable[[], bool]:
    """Whether the task of this thread, which a worker performs, is wanted by nobody any more."""
    from distributed import get_worker

    with suppress(ValueError, AttributeError):
        worker = get_worker()
        tasks, key = worker.state.tasks, worker.get_current_task()
        return lambda: key not in tasks or tasks[key].state == "cancelled"
    return lambda: False
