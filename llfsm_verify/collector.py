"""Python's garbage collector, paused: while trees that live on are built, it would look through them again and again;
while another thread works with Z3, it would free terms of that thread.
"""

from __future__ import annotations

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager

_one_task = [False]


@contextmanager
def paused_collector(*, lasting: bool = False) -> Iterator[None]:
    """Collect no cycles inside; what is no longer referred to is freed as ever. Also for whole functions.

    `lasting`: what is built inside is used to the end of a process that does one task, and is mostly not garbage.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            if lasting and _one_task[0] and gc.get_count()[0] > gc.get_threshold()[0]:
                gc.freeze()
            gc.enable()


def do_one_task() -> None:
    """This process does one task and ends. From now on the collector leaves alone what is large and lasts, and does not
    look through everything when the process ends."""
    _one_task[0] = True
    atexit.register(gc.freeze)
