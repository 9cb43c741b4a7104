"""A session that leaves everything to another one: for those who change one thing about an engine."""

from __future__ import annotations

from collections.abc import Iterable

from llfsm_verify.checking.engine import Answer, Explored, Holds, Session, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Exploration


class Delegate(Session):
    """Answers as `inner` does."""

    def __init__(self, inner: Session) -> None:
        self.inner = inner
        self.asks_again = inner.asks_again

    def search(self) -> None:
        self.inner.search()

    def ended(self, why: str | None) -> None:
        self.inner.ended(why)

    def answers(self, goal: Goal) -> Iterable[Answer]:
        return self.inner.answers(goal)

    def fault_runs(self) -> Iterable[tuple[int, Violated]]:
        return self.inner.fault_runs()

    def faults(self) -> Holds | Unknown:
        return self.inner.faults()

    def possible(self) -> bool | None:
        return self.inner.possible()

    def explored(self) -> Explored | None:
        return self.inner.explored()

    def watching(self, problem: Problem, nodes: int) -> Explored | None:
        return self.inner.watching(problem, nodes)

    def count(self) -> None:
        self.inner.count()

    def exploration(self) -> Exploration:
        return self.inner.exploration()

    def pulse(self) -> None:
        self.inner.pulse()

    def blamed(self, error: Exception) -> Exception | None:
        return self.inner.blamed(error)

    def close(self) -> None:
        self.inner.close()
