"""A graph that was explored, for questions beside the verdicts: protocol `checking.engine.Explored`."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.checking.engine import Excluded, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.engines.explicit.schedules import Schedules
from llfsm_verify.engines.explicit.search import Search


class ExploredGraph:
    """The graph of a search. `nodes`: explore up to so many of them before anything is asked; None: it is explored."""

    def __init__(self, search: Search, schedules: Schedules, nodes: int | None = None) -> None:
        self._search = search
        self._schedules = schedules
        self._nodes = nodes
        self._explorer = search.explorer

    @property
    def names(self) -> Sequence[str]:
        return self._explorer.observed

    @property
    def masks(self) -> Sequence[int]:
        return sorted({*self._explorer.first_letters, *self._explorer.graph.alphabet})

    def violates(self, goal: Goal) -> bool:
        self._explore()
        return self._search.violates(goal)

    def find(self, goal: Goal, excluded: Excluded | None = None) -> Violated | None:
        self._explore()
        walk = self._search.violation(goal, excluded)
        return None if walk is None else self._schedules.of_walk(walk)

    def escape(self) -> Violated | None:
        self._explore()
        walk = self._search.escape()
        return None if walk is None else self._schedules.of_walk(walk)

    @property
    def unfinished(self) -> str | None:
        graph = self._explorer.graph
        if graph.complete:
            return None
        return graph.stopped or f"no more were found among the first {len(graph):,} configurations"

    def close(self) -> None:
        self._explorer.close()

    def _explore(self) -> None:
        if self._nodes is not None:
            self._explorer.explore(self._nodes)
