"""Questions to a solver that can be stopped: asked for a while, then a look at the limits, then for longer."""

from __future__ import annotations

from collections.abc import Callable

import z3

FIRST_SLICE_MS = 500
"""After so long, and then twice as long each time, a question is interrupted to look at the limits."""


class GaveUp(Exception):
    """The solver does not answer; the message says why, in a sentence."""


def model_of(solver: z3.Solver, check: Callable[[], None]) -> z3.ModelRef | None:
    """A model of what the solver knows; None: there is none.

    `check` is called between two attempts, and raises to stop. Raises GaveUp, and KeyboardInterrupt.
    """
    slice_ms = FIRST_SLICE_MS
    while True:
        solver.set("timeout", slice_ms)
        found = solver.check()
        if found == z3.sat:
            return solver.model()
        if found == z3.unsat:
            return None
        check()
        reason = solver.reason_unknown()
        if "interrupted" in reason:
            raise KeyboardInterrupt
        if reason not in ("timeout", "canceled"):
            raise GaveUp(f"the solver gave up: {reason}")
        slice_ms *= 2
