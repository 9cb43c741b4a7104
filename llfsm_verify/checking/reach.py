"""One question: is this reachable? A program is explored until a run ends in a fault that is asked about.

What is looked for is written into the program as a fault (`transforms`). A run into it is told as moves, which the
executor takes once more before anyone is told of it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import Budget
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program

if TYPE_CHECKING:  # both are rarely there, and Z3 comes with labels
    from llfsm_verify.kripke.labels.labels import Labels
    from llfsm_verify.transforms.cone import Cone

FIRST_LOOK = 2_000
"""Nodes after which a graph is first looked at; then each time it has grown so many times, so that what is near the
start is found in a space that never ends."""
GROWTH = 4


@dataclass(frozen=True, slots=True)
class FaultRun:
    """A shortest run into a fault, which the executor has performed."""

    fault: int
    path: tuple[int, ...]
    """Nodes, from a root to the one from which the fault happens."""
    moves: tuple[Move, ...]


class Reachable:
    """What runs of a program can reach. `explorer` has the graph, for other questions. `close` gives memory back."""

    def __init__(
        self,
        program: Program,
        budget: Budget,
        *,
        roots: Iterable[bytes] | None = None,
        labels: Labels | None = None,
        with_edges: bool = False,
    ) -> None:
        """`roots`: configurations in the layout of `program` to begin with, in place of the initial ones. `labels`,
        `with_edges`: as of `Explorer`."""
        self._program = program

        def records(layout: Layout) -> Iterator[bytes]:
            outputs = layout.encode_outputs(layout.initial_outputs())
            return (root + outputs for root in roots or ())

        begin = None if roots is None else records
        self.explorer = Explorer(program, budget, with_edges=with_edges, labels=labels, roots=begin)
        assert self.explorer.layout.configuration_bytes == Layout.of(program).configuration_bytes
        self.graph = self.explorer.graph

    def explore(self, most_steps: int | None = None) -> str | None:
        """Explore everything, or as far as limits go; why it is unfinished, None: it is not."""
        self.explorer.explore(None, most_steps)
        return self.graph.unfinished

    def fault(self, *wanted: Collection[int], most_steps: int | None = None) -> FaultRun | None:
        """Explore until a run ends in one of these faults, rather in one of the first of those collections; None: none
        does (`graph.unfinished`: as far as limits go). Disagreement: the executor does something else."""
        graph, target = self.graph, FIRST_LOOK
        while True:
            self.explorer.explore(target, most_steps)
            for faults in wanted:
                source = min((graph.faults[number] for number in faults if number in graph.faults), default=None)
                if source is not None:
                    return self._run(source, faults)
            if graph.exhausted or graph.stopped is not None:
                return None
            target = max(target, len(graph)) * GROWTH

    def _run(self, source: int, faults: Collection[int]) -> FaultRun:
        path = self.graph.path_to(source)
        fault, last = self.explorer.witnesses.fault(source, faults)
        moves = (*self.explorer.witnesses.along(path), last)
        execution = Execution(self._program)
        layout = execution.layout
        record = self.graph.key(path[0]) + layout.encode_outputs(layout.initial_outputs())
        for move in moves:
            result = execution.step(record, move)
            record = result.record
            if result.status != (fault + 1 if move is last else 0):
                raise Disagreement("the executor does not end in the fault that the search found")
        return FaultRun(fault, tuple(path), moves)

    def close(self) -> None:
        self.explorer.close()


def schedule_of(
    explorer: Explorer, root: int, moves: Sequence[Move], cone: Cone | None = None, loop: int | None = None
) -> Schedule:
    """The run by these moves from a root; where only a `cone` of the program was explored, in the whole of it."""
    whole = moves if cone is None else [Move(m.process, cone.extend(m.choices)) for m in moves]
    return Schedule(explorer.free(root), tuple(whole), loop)
