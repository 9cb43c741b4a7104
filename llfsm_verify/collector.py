"""Python's garbage collector, paused: while trees that live on are built, it would look through them again and again;
while another thread works with Z3, it would free terms of that thread. And what it need not look at again.
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

    `lasting`: what is built inside is mostly not garbage. In a process that does one task, where much was built, the
    collector then looks at nothing again that exists by now.
    """
    collects, before = gc.isenabled(), gc.get_count()[0]
    gc.disable()
    try:
        yield
    finally:
        if collects:
            if lasting and _one_task[0] and gc.get_count()[0] - before > gc.get_threshold()[0]:
                gc.freeze()
            gc.enable()


def do_one_task(every: int | None = None) -> None:
    """This process does one task and ends.

    After something large was built (`lasting`), the collector looks only at what comes later, and at the end of the
    process it looks at nothing. `every`: objects made between two looks for garbage.
    """
    _one_task[0] = True
    if every is not None:
        gc.set_threshold(every, 20, 100)
    atexit.register(gc.freeze)


def do_more_tasks() -> None:
    """This process goes on with other tasks: the collector looks at everything."""
    if _one_task[0]:
        _one_task[0] = False
        gc.unfreeze()


def collect_everything() -> None:
    """Free all that is not used, now."""
    if _one_task[0]:
        gc.unfreeze()
    gc.collect()
