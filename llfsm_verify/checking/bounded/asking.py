"""Constraints that grow, asked again and again."""

from __future__ import annotations

from collections.abc import Sequence

import z3

from llfsm_verify.backends.smt.asking import Effort, GaveUp, model_of
from llfsm_verify.checking.limits import Budget
from llfsm_verify.kripke.explore import LimitReached


class Question:
    """What is asked of a solver of its own, which learns more in between."""

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
            return model_of(self._solver, self._budget.check, self._effort)
        except GaveUp as reason:
            raise LimitReached(str(reason)) from None
        finally:
            self._solver.pop()
