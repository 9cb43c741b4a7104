"""The reachable configurations: which outcomes are among them, and the runs that show them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from llfsm_verify.checking.reach import Reachable, schedule_of
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.kripke.graph import FIRST_BYTES, NUMBER_BYTES, OVERFLOW
from llfsm_verify.kripke.labels.sizes import WIDE, InputNote
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program, Unbounded, Var
from llfsm_verify.semantics.probes import DEAD, Outcome
from llfsm_verify.transforms.cone import Cone, cone
from llfsm_verify.transforms.probing import Probed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_STEPS = 1 << 26
"""Steps of an exploration without a limit of the user: some seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Arrays:
    """A copy of a graph: its packed configurations, shape (n, words), and its edges by source, target and label."""

    keys: NDArray[np.uint64]
    sources: NDArray[np.int64]
    targets: NDArray[np.int64]
    labels: NDArray[np.int64]


class Reach:
    """The exploration of a probed program, by classes of its wide inputs. `close` gives its memory back."""

    def __init__(self, probed: Probed, budget: Budget, *, classes: bool = True, patient: bool = True) -> None:
        """`classes` False: every value of every input is stepped; the graph is the same one.

        `patient` False: where the values of a wide input are stepped one by one, after MOST_STEPS that is too long.
        """
        self.probed: Probed = probed
        self._cone = worthwhile_cone(probed)
        self.program: Program = probed.program if self._cone is None else self._cone.program
        """What was explored: `probed.program`, or the part of it that its probes depend on."""
        labels, stopped = None, None
        try:
            labels = labels_of(self.program, budget) if classes else None
        except LimitReached as limit:
            stopped = str(limit)
        space = Reachable(self.program, budget, labels=labels, with_edges=True)
        self._explorer, self._graph, self.close = space.explorer, space.graph, space.close
        # What a limit has ended is not gone on with value by value.
        self._graph.stopped = self._graph.stopped or stopped
        enumerated = any(note.classes is None for note in self.inputs)
        space.explore(MOST_STEPS if enumerated and not patient else None)
        self.layout = self._explorer.layout

    @property
    def complete(self) -> bool:
        return self._graph.complete

    @property
    def reason(self) -> str | None:
        """Why it is not complete, in a sentence."""
        return self._graph.stopped if self._graph.overflow is None else OVERFLOW

    @property
    def configurations(self) -> int:
        return self._graph.configurations

    @property
    def inputs(self) -> tuple[InputNote, ...]:
        """What became of each wide input."""
        labels = self._explorer.labels
        return () if labels is None else labels.notes

    @property
    def left_out(self) -> tuple[str, ...]:
        """What configurations are counted without, because nothing depends on it."""
        return () if self._cone is None else self._cone.left_out

    @cached_property
    def arrays(self) -> Arrays:
        """Of what was explored."""
        import numpy as np

        graph = self._graph
        count = graph.expanded
        keys = np.frombuffer(graph.keys.view(8 * graph.words * len(graph)), dtype="<u8").reshape(len(graph), -1)
        first = np.frombuffer(graph.first.view(FIRST_BYTES * (count + 1)), dtype="<i8")
        edges = int(first[-1])  # a node under way when a limit was reached is left out
        targets = np.frombuffer(graph.targets.view(NUMBER_BYTES * edges), dtype="<u4")
        labels = np.frombuffer(graph.labels.view(NUMBER_BYTES * edges), dtype="<u4")
        sources = np.repeat(np.arange(count, dtype=np.int64), np.diff(first))
        return Arrays(keys.copy(), sources, targets.astype(np.int64), labels.astype(np.int64))

    @property
    def alphabet(self) -> list[int]:
        """The letters that labels stand for: bit k is the k-th outcome of the probed program."""
        return self._graph.alphabet

    @cached_property
    def _edges(self) -> Mapping[Outcome, int]:
        """The first edge with each outcome: its source is as near to the start as any."""
        import numpy as np

        found: dict[int, int] = {}
        labels, first = np.unique(self.arrays.labels, return_index=True)
        for place in np.argsort(first, kind="stable"):
            mask = self.alphabet[int(labels[place])]
            for bit in range(mask.bit_length()):
                if mask >> bit & 1:
                    found.setdefault(bit, int(first[place]))
        return {outcome: found[bit] for bit, outcome in enumerate(self.probed.outputs) if bit in found}

    def has(self, outcome: Outcome) -> bool:
        """Some run was found in which it comes out."""
        return outcome in self._edges

    def run_to(self, outcome: Outcome) -> Schedule:
        """A shortest run whose last step has the outcome. KeyError where none was found."""
        edge, arrays = self._edges[outcome], self.arrays
        source, target = int(arrays.sources[edge]), int(arrays.targets[edge])
        return self._run(source, self._explorer.witnesses.step(source, target, self.alphabet[int(arrays.labels[edge])]))

    def run_to_configuration(self, node: int) -> Schedule:
        """A shortest run to a configuration."""
        return self._run(node)

    def walk(self, edges: Sequence[int]) -> list[Move]:
        """The moves of these edges, which follow each other."""
        arrays, step = self.arrays, self._explorer.witnesses.step
        moves = [
            step(int(arrays.sources[e]), int(arrays.targets[e]), self.alphabet[int(arrays.labels[e])]) for e in edges
        ]
        return list(schedule_of(self._explorer, 0, [move for some in moves for move in some], self._cone).ringlets)

    def first_root(self) -> int | None:
        """The initial configuration in which all that is free has its `init`."""
        wanted = tuple((v.name, v.init) for v in self.program.vars if v.free)
        return next((r for r in range(self._graph.roots) if self._explorer.free(r) == wanted), None)

    def _run(self, node: int, last: Sequence[Move] = ()) -> Schedule:
        path = self._graph.path_to(node)
        return schedule_of(self._explorer, path[0], [*self._explorer.witnesses.along(path), *last], self._cone)


# ---------------------------------------------------------------- what need not be explored


def worthwhile_cone(probed: Probed) -> Cone | None:
    """The part of a probed program that its probes depend on; None: what is not in it is small, and may be explored.

    A sensor's value that is stored and never read is the usual case: nothing is told apart by its 65,536 values. What
    is asked of machines that starve (their states, whether they finished, whether their processes ended) stays in it.
    """
    found = cone(probed.program, _asked(probed.program))
    kept = {v.name for v in found.program.vars}
    gone = [v for v in probed.program.vars if not v.output and v.name not in kept]
    return found if any(map(_is_wide, gone)) else None


def _is_wide(v: Var) -> bool:
    if isinstance(v.type, Unbounded):
        return True
    values = v.type.high - v.type.low + 1
    return math.prod([values] * (1 if v.length is None else v.length)) > WIDE


def _asked(program: Program) -> set[str]:
    """The variables that questions about graphs read."""
    names = {DEAD, *(p.ended for p in program.processes if p.ended is not None)}
    names |= {f"{m.name}.{part}" for m in program.machines for part in ("$state", "$finished", "$loaded")}
    return names & {v.name for v in program.vars}
