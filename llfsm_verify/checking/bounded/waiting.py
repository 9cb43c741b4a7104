"""Work of a solver that can be ended: it has a thread of its own, while this one looks at the limits and at Ctrl-C."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from llfsm_verify.checking.limits import Budget

if TYPE_CHECKING:
    import z3

LOOK_SECONDS = 0.1
"""How often the limits are looked at."""
T = TypeVar("T")


def waited(work: Callable[[], T], context: z3.Context, budget: Budget) -> T:
    """What `work` returns, or raises. It uses `context` and no other thread does, and it leaves Ctrl-C alone.

    LimitReached, KeyboardInterrupt: the work was interrupted.
    """
    returned: list[T] = []
    raised: list[Exception] = []

    def run() -> None:
        try:
            returned.append(work())
        except Exception as problem:  # noqa: BLE001 - it is raised again by who waits
            raised.append(problem)

    thread = threading.Thread(target=run, daemon=True)
    collects = gc.isenabled()
    gc.disable()  # a term that is collected here is one that the other thread works with
    thread.start()
    try:
        while thread.is_alive():
            thread.join(LOOK_SECONDS)
            budget.check()
    except BaseException:
        while thread.is_alive():
            context.interrupt()
            thread.join(LOOK_SECONDS)
        raise
    finally:
        if collects:
            gc.enable()
    if raised:
        raise raised[0]
    return returned[0]
