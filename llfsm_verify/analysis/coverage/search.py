"""Test vectors found by exploration: few runs that together cover all that is reachable.

Greedy: a run goes on along a shortest path to the nearest outcome that is still wanted, and where none can be reached
any more, a new run begins; runs of which others have everything are dropped. Each run is a walk of the explored
arrangement, with its model of the surroundings; an image has none, so it is given what the model wrote as inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import TYPE_CHECKING

from llfsm_verify.analysis.coverage.goals import goals_of
from llfsm_verify.analysis.coverage.measure import MAX_STATES, Performer, reachable_way, told
from llfsm_verify.analysis.coverage.running import ended, field_names, performed
from llfsm_verify.analysis.coverage.vectorfile import program_hash
from llfsm_verify.analysis.coverage.vectors import Sequence as Run
from llfsm_verify.analysis.coverage.vectors import Unit, Vectors
from llfsm_verify.analysis.lint.reach import Reach
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.limits import Budget, Limits, tick
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.probes import DEAD, Outcome
from llfsm_verify.transforms.narrowing import narrowed
from llfsm_verify.transforms.probing import Probed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_TOGETHER = 1 << 10
"""Values of all inputs that are held, together, that are all tried."""
MOST_VALUES = 64
"""Of a wide input that is held."""
Rows = Sequence[Sequence[int]]


@dataclass(frozen=True, slots=True)
class Found:
    """Vectors, what comes out in them, and how many ringlets they have."""

    vectors: Vectors
    seen: frozenset[Outcome]
    steps: int


def find_vectors(
    arrangement: Arrangement, image: Arrangement, first: Mapping[str, int], unit: Unit, limits: Limits | None = None
) -> Found:
    """Vectors for `image`, the runnable form of `arrangement`, which has its model of the surroundings and the same
    timing. `first`: what choices of the image's program are before somebody gives them.

    As far as limits allow. Raises DiagnosticError: the arrangement has no meaning.
    """
    limits = limits or Limits()
    explored, of = arrangement, told(arrangement)
    if unit == "cycle":
        explored = _held(arrangement)
        of = _narrow(told(explored), arrangement, image, first, limits)
    program = lower(image, keep_all_bits=True)
    execution = Execution(program)
    inputs = tuple(choice.name for choice in program.choices)
    empty = Vectors(program_hash(program), unit, inputs, field_names(program), ())
    reach = Reach(of, Budget(replace(limits, max_states=limits.max_states or MAX_STATES)))
    try:
        ways = (reachable_way(goal, reach) for goal in goals_of(explored, reach.probed))
        wanted = frozenset(outcome for way in ways if way is not None for outcome in way)
        search = _Search(reach, wanted, program, first, cycle=unit == "cycle")
        found = [_Shown(execution, image, empty, rows) for rows in search.runs()]
    finally:
        reach.close()
    kept = _needed(found)
    vectors = replace(empty, sequences=tuple(one.run for one in kept))
    return Found(vectors, frozenset().union(*(one.seen for one in kept)), sum(one.steps for one in kept))


def _held(arrangement: Arrangement) -> Arrangement:
    """The same, with inputs that keep their values for a cycle."""
    board = (replace(w, changes="cycle") if w.changes == "step" else w for w in arrangement.whiteboard)
    return replace(arrangement, whiteboard=tuple(board))


def _narrow(
    held: Probed, arrangement: Arrangement, image: Arrangement, first: Mapping[str, int], limits: Limits
) -> Probed:
    """A program of held inputs in which wide ones, which multiply its configurations, have only the values that vectors
    of ringlets give them: one or more of each class."""
    sizes = {c.name: c.type.high - c.type.low + 1 for c in held.program.choices if c.input}
    least = MOST_TOGETHER if prod(sizes.values()) <= MOST_TOGETHER else 2
    wide = [name for name, size in sizes.items() if size > least]
    if not wide:
        return held
    vectors = find_vectors(arrangement, image, first, "ringlet", limits).vectors
    places = {name: place for place, name in enumerate(vectors.inputs)}
    values = {
        name: tuple(sorted({row[places[name]] for run in vectors.sequences for row in run.inputs}))[:MOST_VALUES]
        for name in wide
        if name in places
    }
    return replace(held, program=narrowed(held.program, {name: given for name, given in values.items() if given}))


class _Shown:
    """A sequence of inputs performed by the executor on the image, and what comes out in it."""

    def __init__(self, execution: Execution, image: Arrangement, empty: Vectors, rows: Rows) -> None:
        self.run: Run
        self.run, moves = performed(execution, empty, rows)
        performer = Performer(image)
        performer.take((), moves)
        self.seen, self.steps = frozenset(performer.seen), len(moves)


def _needed(found: Sequence[_Shown]) -> list[_Shown]:
    """Those that are left when each of which the others have everything is dropped, the shortest first."""
    kept = list(found)
    for one in sorted(found, key=lambda shown: shown.steps):
        others = frozenset().union(*(other.seen for other in kept if other is not one))
        if one.seen <= others:
            kept.remove(one)
    return kept


class _Search:
    """Walks of an explored graph that go from one wanted outcome to the nearest next one."""

    def __init__(
        self, reach: Reach, wanted: frozenset[Outcome], image: Program, first: Mapping[str, int], *, cycle: bool
    ) -> None:
        import numpy as np

        self._reach, self._image, self._first, self._cycle = reach, image, first, cycle
        self._execution = Execution(reach.probed.program)
        self._variables = {v.name for v in reach.probed.program.vars if not v.output and v.length is None}
        bits = {outcome: 1 << bit for bit, outcome in enumerate(reach.probed.outputs)}
        self._open = sum(bits[outcome] for outcome in wanted)
        arrays = reach.arrays
        count = int(arrays.sources[-1]) + 1 if len(arrays.sources) else 0
        self._begin = np.searchsorted(arrays.sources, np.arange(count + 1))
        self._nodes = len(arrays.keys)
        self._from = np.full(self._nodes, -1, dtype=np.int64)

    def runs(self) -> list[list[tuple[int, ...]]]:
        """The inputs of each run."""
        root, found = self._reach.first_root(), list[list[tuple[int, ...]]]()
        while root is not None:
            walk = self._walk(root)
            if not walk:
                break
            found.append(walk)
        return found

    def _walk(self, node: int) -> list[tuple[int, ...]]:
        rows: list[tuple[int, ...]] = []
        free = self._reach.program
        record = self._execution.start([(v.name, v.init) for v in free.vars if v.free and isinstance(v.init, int)])
        values = [self._first.get(c.name, c.type.low) for c in self._image.choices]
        begins, ends = True, self._execution.layout.reader(self._reach.probed.program.cycle)
        while True:
            path = self._nearest(node)
            if path is None:
                return rows
            while path:
                for edge, move in zip(path, self._reach.walk(path), strict=True):
                    tick()
                    self._open &= ~self._reach.alphabet[int(self._reach.arrays.labels[edge])]
                    node = int(self._reach.arrays.targets[edge])
                    record = self._execution.step(record, move).record
                    values = self._inputs(values, move, record)
                    if begins or not self._cycle:
                        rows.append(tuple(values))
                    begins = bool(ends(record))
                if self._failed(record):
                    return rows
                path = [] if begins or not self._cycle or ended(self._execution, record) else self._onwards(node)

    def _failed(self, record: bytes) -> bool:
        """Whether a fault has ended the run."""
        return self._reach.probed.has_faults and bool(self._execution.layout.reader(DEAD)(record))

    def _onwards(self, node: int) -> list[int]:
        """An edge that goes on from a node within its cycle; none where it was not explored."""
        more = node + 1 < len(self._begin) and self._begin[node] < self._begin[node + 1]
        return [int(self._begin[node])] if more else []

    def _inputs(self, before: Sequence[int], move: Move, record: bytes) -> list[int]:
        """What the image is given for a ringlet."""
        layout = self._execution.layout

        def value(choice: Choice, old: int) -> int:
            if choice.input in self._variables:  # also what was sampled into it
                return int(layout.reader(choice.input)(record))
            if choice.name in move.choices:
                return move.choices[choice.name]
            return old if choice.input else choice.type.low

        return [value(choice, old) for choice, old in zip(self._image.choices, before, strict=True)]

    def _nearest(self, start: int) -> list[int] | None:
        """The edges of a shortest path from a node whose last step shows something wanted."""
        import numpy as np

        if not self._open:
            return None
        arrays = self._reach.arrays
        shows = np.array([bool(mask & self._open) for mask in self._reach.alphabet], dtype=np.bool_)
        self._from.fill(-1)
        seen = np.zeros(self._nodes, dtype=np.bool_)
        seen[start] = True
        frontier: NDArray[np.int64] = np.array([start], dtype=np.int64)
        while len(frontier):
            tick()
            edges = self._edges(frontier[frontier < len(self._begin) - 1])
            hits = edges[shows[arrays.labels[edges]]]
            if len(hits):
                return self._back(start, int(hits[0]))
            new = edges[~seen[arrays.targets[edges]]]
            frontier, places = np.unique(arrays.targets[new], return_index=True)
            self._from[frontier] = new[places]
            seen[frontier] = True
        return None

    def _edges(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """The numbers of all edges from these nodes."""
        import numpy as np

        begin, counts = self._begin[nodes], self._begin[nodes + 1] - self._begin[nodes]
        ends = np.cumsum(counts)
        total = int(ends[-1]) if len(ends) else 0
        return np.repeat(begin - (ends - counts), counts) + np.arange(total, dtype=np.int64)

    def _back(self, start: int, last: int) -> list[int]:
        path, node = [last], int(self._reach.arrays.sources[last])
        while node != start:
            path.append(int(self._from[node]))
            node = int(self._reach.arrays.sources[path[-1]])
        return path[::-1]
