"""Bounded model checking: every violation of one length before the next, by a solver, confirmed by the executor."""

from __future__ import annotations

import time
from collections.abc import Sequence

from llfsm_verify.backends.smt.arithmetic import Arithmetic
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import (
    FaultResult,
    Options,
    Result,
    Verdict,
)
from llfsm_verify.engines.unrolled.search import DEPTH, BoundedSearch, Task
from llfsm_verify.limits import LimitReached

NAME = "bmc"
FARTHER = "--depth N looks further"


class BoundedEngine:
    """Bounded model checking (``--engine bmc``). It finds violations, and proves nothing."""

    name = NAME

    def __init__(self, arithmetic: Arithmetic | None = None) -> None:
        """`arithmetic`: the theory of numbers (chosen by the program where None)."""
        self._arithmetic = arithmetic

    def check(self, problem: Problem, options: Options) -> Result:
        """Faults and every property are violated, or unknown. Disagreement when a trace is not confirmed."""
        return _Session(problem, options, self._arithmetic).run()


class _Session:
    def __init__(self, problem: Problem, options: Options, arithmetic: Arithmetic | None) -> None:
        self._options = options
        self._search = BoundedSearch(problem, options, NAME, arithmetic)

    def run(self) -> Result:
        """As `BoundedEngine.check`."""
        with self._search.budget:
            return self._run()

    def _run(self) -> Result:
        started = time.monotonic()
        search = self._search
        interrupted, why = False, None
        tasks: list[Task] = []
        try:
            tasks = [search.task(goal) for goal in search.goals]
            why = self._looked(tasks)
        except KeyboardInterrupt:
            interrupted, why = True, "interrupted"
        except (LimitReached, MemoryError) as limit:
            why = str(limit) or "the memory ran out"
        asked = {id(t.goal): t for t in tasks}
        results = tuple(search.result(goal, asked.get(id(goal)), why) for goal in search.goals)
        none = f"no run of up to {len(search):,} steps ends in a fault ({FARTHER})" if why == self._reached else why
        faults = FaultResult(Verdict.UNKNOWN, (), none)
        if search.faults:
            faults = FaultResult(Verdict.VIOLATED, tuple(search.faults))
        seconds = time.monotonic() - started
        return search.whole(results, faults, seconds=seconds, complete=False, interrupted=interrupted)

    def _looked(self, tasks: Sequence[Task]) -> str:
        """Look at longer and longer runs; why the search ended."""
        depth = self._options.depth or DEPTH
        while True:
            self._search.look(tasks)
            if len(self._search) >= depth:
                return self._reached
            if tasks and all(t.result is not None for t in tasks):
                return "something was found for every property, so the search ended"
            self._search.look_for_faults()
            self._search.extend()

    @property
    def _reached(self) -> str:
        return f"no run of up to {len(self._search):,} steps violates it ({FARTHER})"
