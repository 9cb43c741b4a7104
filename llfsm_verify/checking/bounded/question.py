"""A growing question to a solver."""

from __future__ import annotations

from collections.abc import Sequence

import z3

from llfsm_verify.checking.bounded.waiting import waited
from llfsm_verify.checking.limits import Budget
from llfsm_verify.kripke.explore import LimitReached


class Exhausted(Exception):
    """A question took more work than it may."""


class Question:
    """What is asked again and again of a solver of its own, which learns more in between."""

    def __init__(self, *, finite: bool, effort: int | None = None) -> None:
        """`finite`: Booleans and bit-vectors only. `effort`: units of Z3's work for each time it is asked."""
        self._effort = effort
        self._sent: dict[int, int] = {}
        self._told: list[z3.BoolRef] = []
        self._solver = z3.SolverFor("QF_FD") if finite else z3.Solver()
        self._solver.set("ctrl_c", False)  # it is for the thread that waits
        if effort is not None:
            self._solver.set("rlimit", effort)

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
        self._solver.push()
        try:
            self._solver.add(*extra)
            found = waited(self._solver.check, self._solver.ctx, budget)
            if found == z3.sat:
                return self._solver.model()
            if found == z3.unsat:
                return None
            if self._effort is not None:
                raise Exhausted
            raise LimitReached(f"the solver gave up: {self._solver.reason_unknown()}")
        finally:
            self._solver.pop()

    def text(self, extra: Sequence[z3.BoolRef]) -> str:
        """What `ask` asks, for any solver that reads SMT-LIB 2."""
        whole = z3.Solver()  # that for bit-vectors does not tell what it was told
        whole.add(*self._told, *extra)
        return str(whole.to_smt2())
