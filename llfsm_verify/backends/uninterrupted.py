"""Ctrl-C waits while LLVM works: an exception in between would leave modules with two owners, and free them twice."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


@contextmanager
def uninterrupted() -> Iterator[None]:
    """An interrupt that comes meanwhile is served at the end. Other threads than the main one never get any."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    came: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            before(came[0], None)


def whole(function: Callable[P, R]) -> Callable[P, R]:
    """The function without interrupts."""

    @wraps(function)
    def shielded(*args: P.args, **kwargs: P.kwargs) -> R:
        with uninterrupted():
            return function(*args, **kwargs)

    return shielded
