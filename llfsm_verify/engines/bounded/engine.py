"""Bounded model checking: every violation of one length before the next, by a solver."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from llfsm_verify.backends.smt.arithmetic import Arithmetic
from llfsm_verify.checking.engine import Answer, Given, Session, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.verdict import Exploration
from llfsm_verify.diagnostics import counted
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.engines.unrolled.search import DEPTH, BoundedSearch, Task

FARTHER = "--depth N looks further"


class BoundedSession(Session):
    """Bounded model checking (``--engine bmc``). It finds violations, and proves nothing."""

    def __init__(self, given: Given, arithmetic: Arithmetic | None = None) -> None:
        """`arithmetic`: the theory of numbers (chosen by the program where None)."""
        self._depth = given.options.of(UnrolledOptions).depth or DEPTH
        self._search = BoundedSearch(given, arithmetic)
        self._tasks: dict[int, Task] = {}
        """By `id` of the goal."""
        self._why: str | None = None
        """Why the search ended."""

    def search(self) -> None:
        """Look at longer and longer runs."""
        search = self._search
        for goal in search.goals:
            self._tasks[id(goal)] = search.task(goal)
        tasks = list(self._tasks.values())
        while True:
            search.look(tasks)
            if len(search) >= self._depth:
                return
            if tasks and all(t.found is not None for t in tasks):
                self._why = "something was found for every property, so the search ended"
                return
            search.look_for_faults()
            search.extend()

    def ended(self, why: str | None) -> None:
        self._why = why or self._why

    def answers(self, goal: Goal) -> Iterator[Answer]:
        why = self._why or f"no run of up to {counted(len(self._search), 'step')} violates it ({FARTHER})"
        yield self._search.answer(self._tasks.get(id(goal)), why)

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        yield from self._search.faults.items()

    def faults(self) -> Unknown:
        none = f"no run of up to {counted(len(self._search), 'step')} ends in a fault"
        beyond = self._search.unperformed
        beyond = f" that the executor can perform: {beyond}" if beyond else f" ({FARTHER})"
        return Unknown(self._why or none + beyond)

    def exploration(self) -> Exploration:
        return replace(self._search.exploration, complete=False)
