"""What a worker of a cluster does with a task: it performs it, unless it is another version, until it is cancelled."""

from __future__ import annotations

import ctypes
import pickle
import sys
import tempfile
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
    """What the pickled `work`, a call and its task, gives. OtherVersion: these are not the `wanted` versions.

    Where the task is cancelled, the call is interrupted as by Ctrl-C; Reschedule: if it is wanted again meanwhile.
    """
    from distributed import Reschedule

    if versions() != wanted:
        raise OtherVersion(versions())
    call, task = pickle.loads(work)  # noqa: S301 - who may give tasks to a worker may let it do anything
    lock, ended, stopped, thread = threading.Lock(), threading.Event(), threading.Event(), threading.get_ident()
    cancelled = _cancellation()

    def watch() -> None:
        while not ended.wait(LOOK):
            with lock:
                if not ended.is_set() and cancelled():
                    stopped.set()
                    interrupt = ctypes.py_object(KeyboardInterrupt)
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), interrupt)
                    return

    threading.Thread(target=watch, daemon=True).start()
    found: object = None
    try:
        try:
            found = call(task)
        finally:
            with lock:
                ended.set()
    except KeyboardInterrupt:
        stopped.set()
    if stopped.is_set():
        raise Reschedule
    return found


def _cancellation() -> Callable[[], bool]:
    """Whether the task of this thread, which a worker performs, is wanted by nobody any more. Its temporary files are
    in the worker's folder."""
    from distributed import get_worker

    with suppress(ValueError, AttributeError):
        worker = get_worker()
        tempfile.tempdir = worker.local_directory  # which Dask removes, also where the worker was killed
        tasks, key = worker.state.tasks, worker.get_current_task()
        return lambda: key not in tasks or tasks[key].state == "cancelled"
    return lambda: False
