"""Questions to a solver that can be stopped: asked for a while, then a look at the limits, then for longer."""

from __future__ import annotations

from collections.abc import Callable

import z3

FIRST_SLICE_MS = 500
"""After so long, and then twice as long each time, a question is interrupted to look at the limits."""


class GaveUp(Exception):
    """The solver does not answer; the message says why, in a sentence."""


def model_of(solver: z3.Solver, check: Callable[[], None], effort: int | None = None) -> z3.ModelRef | None:
    """A model of what the solver knows; None: there is none.

    `check` is called between two attempts, and raises to stop. `effort` is a limit in the solver's own units of work,
    so that giving up does not depend on the computer. Raises GaveUp, and KeyboardInterrupt.
    """
    slice_ms = FIRST_SLICE_MS
    if effort is not None:
        solver.set("rlimit", effort)
    while True:
        solver.set("timeout", slice_ms)
        before = _work(solver) if effort is not None else 0
        found = solver.check()
        if found == z3.sat:
            return solver.model()
        if found == z3.unsat:
            return None
        check()
        reason = solver.reason_unknown()
        if "interrupted" in reason:
            raise KeyboardInterrupt
        if effort is not None and _work(solver) - before >= effort:
            raise GaveUp(f"the solver does not find an answer with {effort:,} units of work")
        if reason not in ("timeout", "canceled"):
            raise GaveUp(f"the solver gave up: {reason}")
        slice_ms *= 2


def _work(solver: z3.Solver) -> int:
    """Units of work done so far."""
    counts = solver.statistics()
    return int(counts.get_key_value("rlimit count")) if "rlimit count" in counts.keys() else 0  # noqa: SIM118
