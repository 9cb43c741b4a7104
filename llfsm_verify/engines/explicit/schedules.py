"""From a walk of the search to a schedule: which choices take the executor the same way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from llfsm_verify.checking.engine import Violated
from llfsm_verify.checking.reach import schedule_of
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.lassos import Walk

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
        pairs = zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False)
        parts = [self._explorer.witness(source, target, letter) for source, target, letter in pairs]
        loop = None if walk.loop is None else sum(len(p) for p in parts[: walk.loop])
        if walk.ends is not None:
            parts.append(self._explorer.letter_witness(walk.nodes[-1], walk.ends))
        schedule = schedule_of(
            self._explorer, walk.nodes[0], [move for part in parts for move in part], self._reduction, loop
        )
        if walk.ends is not None:
            return Violated(schedule)
        return Violated(schedule, tuple(map(self._letter, walk.shown)), recurs=self._reduction is None)

    def of_fault(self, number: int, path: Sequence[int]) -> Violated:
        """A run into fault `number`, which happens in a step from the last configuration of `path`."""
        return Violated(schedule_of(self._explorer, path[0], self._explorer.moves(path, number), self._reduction))

    def _letter(self, mask: int) -> Letter:
        return frozenset(n for i, n in enumerate(self._explorer.observed) if mask >> i & 1)
