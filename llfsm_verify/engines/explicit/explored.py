"""A graph that was explored, for questions beside the verdicts (`checking.engine.Explored`), and schedules of its
walks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

from llfsm_verify.checking.engine import Excluded, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.reach import schedule_of
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.lassos import Walk
from llfsm_verify.limits import LimitReached, tick
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.transforms.cone import Cone


class Schedules:
    """Makes the schedules of one exploration.

    With `reduction` the explorer searched a cone of influence: the steps are extended to the whole program, which is
    the one performed, and what the cone leaves out may recur late.
    """

    def __init__(self, explorer: Explorer, reduction: Cone | None = None) -> None:
        self._explorer = explorer
        self._reduction = reduction

    def of_walk(self, walk: Walk) -> Violated:
        """A walk that a search has found."""
        parts: list[list[Move]] = []
        for source, target, letter in zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False):
            tick()
            parts.append(self._explorer.witnesses.step(source, target, letter))
        loop = None if walk.loop is None else sum(len(p) for p in parts[: walk.loop])
        if walk.ends is not None:
            parts.append(self._explorer.witnesses.letter(walk.nodes[-1], walk.ends))
        schedule = schedule_of(
            self._explorer, walk.nodes[0], [move for part in parts for move in part], self._reduction, loop
        )
        if walk.ends is not None:
            return Violated(schedule)
        return Violated(schedule, tuple(map(self._letter, walk.shown)), recurs=self._reduction is None)

    def of_fault(self, number: int, path: Sequence[int]) -> Violated:
        """A run into fault `number`, which happens in a step from the last configuration of `path`."""
        witnesses = self._explorer.witnesses
        moves = [*witnesses.along(path), witnesses.fault(path[-1], (number,))[1]]
        return Violated(schedule_of(self._explorer, path[0], moves, self._reduction))

    def _letter(self, mask: int) -> Letter:
        return frozenset(n for i, n in enumerate(self._explorer.observed) if mask >> i & 1)


MOST = 10_000
"""Nodes of a graph that is looked at."""


def longest_run(explorer: Explorer, program: Program) -> int | None:
    """Steps of the longest run until the arrangement ends, where every run does.

    None: some run goes on forever or into a fault, or it was not looked at: the graph of `program` is not complete, is
    larger than MOST, was stored without edges, or passes over chains.
    """
    graph = explorer.graph
    names = [process.ended for process in program.processes]
    known = graph.complete and graph.with_edges and graph.sequences is None and not graph.faults
    if not known or len(graph) > MOST or None in names:
        return None
    readers = [explorer.layout.reader(name) for name in names if name is not None]
    after: dict[int, set[int]] = {}
    for node in range(len(graph)):
        has_ended = all(read(graph.key(node)) for read in readers)
        after[node] = set() if has_ended else {target for target, _ in graph.arcs(node)}
    left: dict[int, int] = {}
    try:
        for node in TopologicalSorter(after).static_order():
            left[node] = max((1 + left[target] for target in after[node]), default=0)
    except CycleError:
        return None
    return max((left[root] for root in range(graph.roots)), default=None)


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

    def violates(self, goal: Goal, *, assuming: bool = True) -> bool:
        self._explore()
        search, _ = self._able(goal)
        return search.violates(goal, assuming=assuming)

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
