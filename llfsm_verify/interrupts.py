"""Where an exception that a signal raises would be lost, or break something: there the signal has to wait.

`deferring` is enough where only our own handlers can come. `whole` keeps off all others as well: Python's own, and
those of a program that imports us.
"""

from __future__ import annotations

import _weakrefset
import gc
import os
import signal
import sys
import threading
import time
import weakref
from _thread import start_new_thread
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")

SOON = 0.005
"""Seconds after which it is tried again."""
TOLD_OF_THE_END = (weakref.__file__, _weakrefset.__file__)
"""Modules whose functions are told that an object is gone."""
LOCKING = (threading.__file__, str(Path(threading.__file__).parent / "concurrent" / "futures" / "_base.py"))
HOLDING = frozenset({"__enter__", "__exit__", "_release_save", "_acquire_restore"})
"""Functions of the modules `LOCKING` that take or release locks, which their caller then releases or takes again."""


_deferring: set[CodeType] = set()


def deferring(function: Callable[P, R]) -> Callable[P, R]:
    """The function, in which, and in what it calls, no signal raises an exception."""
    _deferring.add(cast(FunctionType, function).__code__)
    return function


def whole(function: Callable[P, R]) -> Callable[P, R]:
    """The function without signals in between: those that come meanwhile are served at its end.

    LLVM needs it: an exception in between would leave modules with two owners, and free them twice. Only the main
    thread serves signals.
    """

    @wraps(function)
    def shielded(*args: P.args, **kwargs: P.kwargs) -> R:
        if threading.current_thread() is not threading.main_thread():
            return function(*args, **kwargs)
        came: dict[int, None] = {}
        try:
            return _noting(came, lambda: function(*args, **kwargs))
        finally:
            _raise_each(list(came))

    return shielded


@deferring
def _noting(came: dict[int, None], work: Callable[[], R]) -> R:
    """What `work` gives; `came` takes the signals with a handler in Python that come meanwhile."""
    numbers = signal.valid_signals()
    handlers = {number: handler for number in numbers if callable(handler := signal.getsignal(number))}
    noting = True

    def note(number: int, frame: FrameType | None) -> None:
        if noting:
            came[number] = None
        else:  # a handler that was put back raised an exception before this one was
            handlers[signal.Signals(number)](number, frame)

    try:
        for number in handlers:
            signal.signal(number, note)
        return work()
    finally:
        noting = False
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _raise_each(numbers: list[int]) -> None:
    if numbers:
        try:
            signal.raise_signal(numbers[0])
        finally:
            _raise_each(numbers[1:])


def waits(frame: FrameType | None) -> bool:
    """Whether no exception may be raised in this frame: it, or one of its callers, is one of these.

    - a destructor, or where something is told that an object is gone or that the garbage collector works: Python
      prints the exception and forgets it;
    - the constructor of an object that has a destructor, which would work on an object that is half made;
    - Python code by which ctypes converts an argument: the exception comes out as another one;
    - where `threading` or `concurrent.futures` takes or releases a lock: it would stay taken, and who waits for it
      would wait forever (but for a `Condition` with an RLock, whose functions have no frames);
    - a function that is `deferring`.
    """
    told = {getattr(callback, "__code__", None) for callback in gc.callbacks}
    while frame is not None:
        name, file = frame.f_code.co_name, frame.f_code.co_filename
        if name in ("__del__", "from_param") or file in TOLD_OF_THE_END:
            return True
        if (name in HOLDING and file in LOCKING) or frame.f_code in _deferring or frame.f_code in told:
            return True
        if name == "__init__" and hasattr(type(frame.f_locals.get("self")), "__del__"):
            return True
        frame = frame.f_back
    return False


def interrupt(number: int, frame: FrameType | None) -> None:
    """A handler for Ctrl-C: raises KeyboardInterrupt, or sends the signal again soon, where that has to wait."""
    if not waits(frame):
        raise KeyboardInterrupt
    start_new_thread(_again, (number,))  # a `threading.Thread` takes locks, which this thread may hold


def _again(number: int) -> None:
    time.sleep(SOON)
    os.kill(os.getpid(), number)


def serve(leave: Callable[[], None], handler: Callable[[int, FrameType | None], None] = interrupt) -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, also where the process was started with Ctrl-C ignored.

    `leave` ends the process when Python has forgotten a KeyboardInterrupt all the same.
    """

    @deferring
    def forgotten(unraisable: sys.UnraisableHookArgs) -> None:
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            leave()
        sys.__unraisablehook__(unraisable)

    signal.signal(signal.SIGINT, handler)
    sys.unraisablehook = forgotten
