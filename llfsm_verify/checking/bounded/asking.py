"""Questions to a solver: in slices of its own units of work, so that answers do not depend on the clock."""

from __future__ import annotations

from collections.abc import Sequence

import z3

from llfsm_verify.checking.limits import Budget
from llfsm_verify.kripke.explore import LimitReached

FIRST_SLICE, LARGEST_SLICE = 1 << 18, 1 << 22
"""Z3's resource units after which a question is interrupted to look at the limits; each slice is twice the last.
A million take about a second or two."""
GIVEN_UP = ("canceled", "timeout", "max. resource limit exceeded")


class Effort:
    """What solvers may do for one engine, in Z3's resource units; the same input spends the same on every machine."""

    def __init__(self, most: int | None) -> None:
        """`most` None: there is no limit."""
        self._most = most
        self.spent = 0

    @property
    def left(self) -> int | None:
        return None if self._most is None else max(self._most - self.spent, 0)

    def check(self) -> None:
        """LimitReached when it is spent."""
        if self.left == 0:
            raise LimitReached(f"the solver's effort of {self._most:,} units was spent")


class Question:
    """Constraints that grow, asked again and again, with a solver of its own."""

    def __init__(self, budget: Budget, effort: Effort, *, finite: bool) -> None:
        """`finite`: Booleans and bit-vectors only."""
        self._solver = z3.SolverFor("QF_FD") if finite else z3.Solver()
        self._budget = budget
        self._effort = effort
        self._sent: dict[int, int] = {}

    def learn(self, constraints: Sequence[z3.BoolRef]) -> None:
        """Of a list that grows, the constraints that the solver does not know yet."""
        known = self._sent.get(id(constraints), 0)
        self._solver.add(*constraints[known:])
        self._sent[id(constraints)] = len(constraints)

    def ask(self, extra: Sequence[z3.BoolRef]) -> z3.ModelRef | None:
        """A model of the constraints and `extra`; None: there is none. LimitReached, KeyboardInterrupt: not known."""
        self._solver.push()
        try:
            self._solver.add(*extra)
            units = FIRST_SLICE
            while True:
                found = self._check(units)
                if found == z3.sat:
                    return self._solver.model()
                if found == z3.unsat:
                    return None
                reason = self._solver.reason_unknown()
                if "interrupted" in reason:
                    raise KeyboardInterrupt
                if not any(words in reason for words in GIVEN_UP):
                    raise LimitReached(f"the solver gave up: {reason}")
                units = min(2 * units, LARGEST_SLICE)
        finally:
            self._solver.pop()

    def _check(self, units: int) -> z3.CheckSatResult:
        self._budget.check()
        self._effort.check()
        if self._effort.left is not None:
            units = min(units, self._effort.left)
        self._solver.set("rlimit", units)
        left = self._budget.left
        if left is not None:
            self._solver.set("timeout", max(int(1000 * left), 1))
        before = self._resources()
        found = self._solver.check()
        self._effort.spent += self._resources() - before
        return found

    def _resources(self) -> int:
        """Units that all solvers of this process have spent so far."""
        return int(self._solver.statistics().get_key_value("rlimit count"))
