"""Questions to a solver that limits and Ctrl-C can end: it has a thread of its own, while this one looks at them.

A solver is never interrupted to be asked again: what it finds afterwards would depend on when that was.
"""

from __future__ import annotations

from _thread import allocate_lock, start_new_thread
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

import z3

from llfsm_verify.collector import paused_collector
from llfsm_verify.interrupts import deferring

LOOK_SECONDS = 0.1
"""How often the limits are looked at."""
T = TypeVar("T")


class GaveUp(Exception):
    """The solver does not answer; the message says why, in a sentence."""


class SolverBudget:
    """What solvers may do, in Z3's own units of work: the same input spends about the same on every machine."""

    def __init__(self, most: int | None = None, within: SolverBudget | None = None) -> None:
        """`most` None: there is no limit but that of `within`, of which this is a part."""
        self.most = most
        self.within = within
        self.spent = 0

    @property
    def left(self) -> int | None:
        """What is left of it, and of what it is within; None: there is no limit."""
        own = None if self.most is None else max(self.most - self.spent, 0)
        others = None if self.within is None else self.within.left
        return own if others is None else others if own is None else min(own, others)

    def spend(self, units: int) -> None:
        self.spent += units
        if self.within is not None:
            self.within.spend(units)

    @property
    def exhausted(self) -> GaveUp:
        whole = self.within if self.within is not None and self.within.left == 0 else self
        return GaveUp(f"the solver finds no answer with {whole.most or 0:,} units of work")


def model_of(solver: z3.Solver, check: Callable[[], None], effort: SolverBudget | None = None) -> z3.ModelRef | None:
    """A model of what the solver knows; None: there is none.

    `check` is called now and then, and raises to stop. Raises GaveUp, and KeyboardInterrupt.
    """
    solver.set("ctrl_c", False)  # it is for the thread that waits
    if effort is not None and effort.left is not None:
        if not effort.left:
            raise effort.exhausted
        solver.set("rlimit", effort.left)
    before = _work(solver)
    found = wait_for(solver.check, solver.ctx, check)
    if effort is not None:
        effort.spend(_work(solver) - before)
    if found == z3.sat:
        return solver.model()
    if found == z3.unsat:
        return None
    if effort is not None and effort.left == 0:
        raise effort.exhausted
    raise GaveUp(f"the solver gave up: {solver.reason_unknown()}")


def _work(solver: z3.Solver) -> int:
    """Units of work that the solvers of this context have done so far."""
    return int(solver.statistics().get_key_value("rlimit count"))


def wait_for(work: Callable[[], T], context: z3.Context, check: Callable[[], None]) -> T:
    """What `work` returns, or raises. It uses `context` and no other thread does, and it leaves Ctrl-C alone.

    What `check` raises, and KeyboardInterrupt, end it: nothing of it goes on when they come out. Where Ctrl-C has the
    handler of `interrupts`, that is so for the second Ctrl-C also.
    """
    returned: list[T] = []
    raised: list[BaseException] = []
    begun: list[bool] = []
    # Ctrl-C in `threading` may leave a lock of its own taken, for which the other thread then waits forever.
    begin, done = allocate_lock(), allocate_lock()
    begin.acquire()
    done.acquire()

    def run() -> None:
        begin.acquire()
        if not begun:
            return
        try:
            returned.append(work())
        except BaseException as problem:  # noqa: BLE001 - it is raised again by who waits
            raised.append(problem)
        done.release()

    def watch() -> None:
        while not (returned or raised):
            if not done.acquire(timeout=LOOK_SECONDS):
                check()

    @deferring
    def end() -> None:
        with suppress(RuntimeError):  # it has been released
            begin.release()
        while begun and not (returned or raised):
            if not done.acquire(timeout=LOOK_SECONDS):
                with suppress(
                    z3.Z3Exception
                ):  # the call of the other thread, once interrupted, leaves it in the context
                    context.interrupt()
        # Only `check` takes an interrupt back. Later work would go on without it: a solver forgets what it is told.
        cleaner = z3.Solver(ctx=context)
        cleaner.set("ctrl_c", False)
        cleaner.check()

    with paused_collector():  # a term that is collected here is one that the other thread works with
        try:
            start_new_thread(run, ())
            begun.append(True)
            begin.release()
            watch()  # the jump back of a loop is outside of the `try` in Python 3.12 and 3.13
        except BaseException:
            end()
            raise
    if raised:
        raise raised[0]
    return returned[0]
