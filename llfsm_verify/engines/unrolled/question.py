"""A growing question to a solver, and the runs that it gives, as schedules."""

from __future__ import annotations

import re
from collections.abc import Sequence

import z3

from llfsm_verify.backends.smt.solver import GaveUp, SolverBudget, model_of, wait_for
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.program.moves import Move

INTERNAL = re.compile(r"\((bv[us](?:div|rem|mod))_i ")
"""Division in Z3's own words, which no other solver reads; it means the same."""


class Exhausted(Exception):
    """A question took more work than it may."""


class Question:
    """What is asked again and again of a solver of its own, which learns more in between."""

    def __init__(self, *, finite: bool, effort: int | None = None, total: SolverBudget | None = None) -> None:
        """`finite`: Booleans and bit-vectors only. `effort`: units of Z3's work for each time it is asked; `total`: for
        all questions of an engine."""
        self._effort, self._total = effort, total
        self._sent: dict[int, int] = {}
        self.told: list[z3.BoolRef] = []
        """What the solver knows, for another one."""
        self._solver = z3.SolverFor("QF_FD") if finite else z3.Solver()

    def add(self, constraints: Sequence[z3.BoolRef]) -> None:
        """Constraints that the solver does not know yet."""
        self._solver.add(*constraints)
        self.told += constraints

    def learn(self, constraints: list[z3.BoolRef], most: int | None = None) -> None:
        """Of a list that grows, or of its first `most`, the constraints that the solver does not know yet."""
        known = self._sent.get(id(constraints), 0)
        self.add(constraints[known:most])
        self._sent[id(constraints)] = max(known, len(constraints) if most is None else most)

    def ask(self, extra: Sequence[z3.BoolRef], budget: Budget) -> z3.ModelRef | None:
        """A run with `extra`; None: there is none. LimitReached, Exhausted (its own effort): that is not known."""
        try:
            wait_for(self._solver.push, self._solver.ctx, budget.check)  # it takes in what was added: perhaps long work
        except z3.Z3Exception as problem:
            raise LimitReached(f"the solver gave up: {problem}") from None
        try:
            self._solver.add(*extra)
            return model_of(self._solver, budget.check, SolverBudget(self._effort, self._total))
        except GaveUp as reason:
            if self._effort is not None:
                raise Exhausted from None
            raise LimitReached(str(reason)) from None
        finally:
            self._solver.pop()


def smt2(terms: Sequence[z3.BoolRef]) -> str:
    """Whether all terms can be true, for any solver that reads SMT-LIB 2."""
    whole = z3.Solver()  # that for bit-vectors does not tell what it was told
    whole.add(*terms)
    return INTERNAL.sub(r"(\1 ", str(whole.to_smt2()))


def schedule_of(run: Unrolling, model: z3.ModelRef, steps: int, start: int | None = None) -> Schedule:
    """The first `steps` steps of a model of a run; `start`: the point that the loop comes back to."""
    program, arithmetic = run.terms.program, run.terms.arithmetic
    single = {c.name: c.type.low for c in program.choices if c.type.low == c.type.high}
    moves: list[Move] = []
    for point in run.points[:steps]:
        way = next(w for w in point.ways if z3.is_true(model.eval(w.when, model_completion=True)))
        chosen = {name: arithmetic.value(model, term) for name, term in way.choices.items()}
        moves.append(Move(way.process, single | chosen))
    free = [(v.name, arithmetic.value(model, run.points[0].values[v.name, None])) for v in program.vars if v.free]
    return Schedule(tuple(free), tuple(moves), None if start is None else start - 1)
