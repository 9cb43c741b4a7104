"""A graph that was explored, for questions beside the verdicts: protocol `checking.engine.Explored`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from llfsm_verify.checking.engine import Excluded, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.engines.explicit.schedules import Schedules
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.limits import LimitReached


class ExploredGraph:
    """The graph of a search.

    `nodes`: explore up to so many of them before anything is asked; None: it is explored. `again` gives the whole graph
    once more, with its edges, for what a graph without them does not tell; None: it has them.
    """

    def __init__(
        self,
        search: Search,
        schedules: Schedules,
        nodes: int | None = None,
        again: Callable[[], tuple[Search, Schedules]] | None = None,
    ) -> None:
        self._search = search
        self._schedules = schedules
        self._nodes = nodes
        self._explorer = search.explorer
        self._again = again
        self._whole: tuple[Search, Schedules] | None = None

    @property
    def names(self) -> Sequence[str]:
        return self._explorer.observed

    @property
    def masks(self) -> Sequence[int]:
        return sorted({*self._explorer.first_letters, *self._explorer.graph.alphabet})

    def violates(self, goal: Goal) -> bool:
        self._explore()
        search, _ = self._able(goal)
        return search.violates(goal)

    def find(self, goal: Goal, excluded: Excluded | None = None) -> Violated | None:
        self._explore()
        search, schedules = self._able(goal, excluded)
        walk = search.violation(goal, excluded)
        return None if walk is None else schedules.of_walk(walk)

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
        if self._whole is not None:
            self._whole[0].explorer.close()

    def _able(self, goal: Goal, excluded: Excluded | None = None) -> tuple[Search, Schedules]:
        """A search whose graph tells about a goal. LimitReached: there is no time or memory for it."""
        if self._again is None or self._search.answers(goal, excluded):
            return self._search, self._schedules
        if self._whole is None:
            self._whole = self._again()
        search, schedules = self._whole
        search.explorer.explore(None)
        if not search.complete:
            raise LimitReached(search.graph.stopped or "the exploration was cut short")
        return search, schedules

    def _explore(self) -> None:
        if self._nodes is not None:
            self._explorer.explore(self._nodes)
