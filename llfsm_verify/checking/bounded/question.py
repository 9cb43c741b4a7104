"""A growing question to a solver, asked in slices of time so that limits and interrupts are served."""

from __future__ import annotations

from collections.abc import Sequence

import z3

from llfsm_verify.checking.limits import Budget
from llfsm_verify.kripke.explore import LimitReached

FIRST_SLICE = 4_000_000
"""After so many units of the solver's work (some tenths of a second), and then twice as many each time, a question is
interrupted to look at the limits."""
MOST_MS = (1 << 31) - 1


class Exhausted(Exception):
    """A question took more work than it may."""


class Question:
    """What is asked again and again of a solver of its own, which learns more in between.

    Slices are measured in the solver's work, not in time, and what was interrupted is asked of a new solver: so the
    models that are found do not depend on the machine.
    """

    def __init__(self, *, finite: bool, effort: int | None = None) -> None:
        """`finite`: Booleans and bit-vectors only. `effort`: units of Z3's work for each time it is asked."""
        self._finite = finite
        self._effort = effort
        self._sent: dict[int, int] = {}
        self._told: list[z3.BoolRef] = []
        self._solver = self._fresh()

    def _fresh(self) -> z3.Solver:
        solver = z3.SolverFor("QF_FD") if self._finite else z3.Solver()
        solver.add(*self._told)
        return solver

    def add(self, constraints: Sequence[z3.BoolRef]) -> None:
        """Constraints that the solver does not know yet."""
        self._solver.add(*constraints)
        self._told += constraints

    def learn(self, constraints: list[z3.BoolRef]) -> None:
        """Of a list that grows, the constraints that the solver does not know yet."""
        known = self._sent.get(id(constraints), 0)
        self.add(constraints[known:])
        self._sent[id(constraints)] = len(constraints)

    def ask(self, extra: Sequence[z3.BoolRef], budget: Budget) -> z3.ModelRef | None:
        """A run with `extra`; None: there is none. LimitReached, Exhausted: that is not known."""
        portion, done = FIRST_SLICE, 0
        while True:
            if self._effort is not None:
                portion = min(portion, self._effort - done)
            self._solver.set("rlimit", portion, "timeout", int(min(max(budget.left, 0.0) * 1_000 + 1, MOST_MS)))
            self._solver.push()
            self._solver.add(*extra)
            found = self._solver.check()
            if found == z3.sat:
                model = self._solver.model()
                self._solver.pop()
                return model
            if found == z3.unsat:
                self._solver.pop()
                return None
            reason = self._solver.reason_unknown()
            self._solver = self._fresh()
            budget.check()
            if "interrupted" in reason:
                raise KeyboardInterrupt
            if not any(word in reason for word in ("timeout", "canceled", "resource")):
                raise LimitReached(f"the solver gave up: {reason}")
            done += portion
            if self._effort is not None and done >= self._effort:
                raise Exhausted
            portion *= 2

    def text(self, extra: Sequence[z3.BoolRef]) -> str:
        """What `ask` asks, for any solver that reads SMT-LIB 2."""
        whole = z3.Solver()  # that for bit-vectors does not tell what it was told
        whole.add(*self._told, *extra)
        return str(whole.to_smt2())
