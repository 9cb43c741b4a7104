"""All configurations of an arrangement with their steps, as proofs need them."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import LimitReached
from llfsm_verify.program.program import Program

MOST_STATES = 1_000_000
"""Product states (and configurations) up to which a certificate is made."""
MOST_STEPS = 20_000_000
"""Steps from them, with all values of inputs, that a certificate is made for: its checker is plain Python."""


class Nodes:
    """Turns records into the lists of values that certificates write.

    A node is the values of a configuration; with ``observe: cycle``, in the middle of a cycle, also of the outputs.
    """

    def __init__(self, program: Program, layout: Layout) -> None:
        def readers(*, output: bool) -> list[Callable[[bytes], int]]:
            chosen = [v for v in program.vars if v.output is output]
            return [layout.reader(v.name, i) for v in chosen for i in ([None] if v.length is None else range(v.length))]

        self._configuration, self._outputs = readers(output=False), readers(output=True)

    def __call__(self, record: bytes, *, in_cycle: bool) -> list[int]:
        values = [read(record) for read in self._configuration]
        return values + [read(record) for read in self._outputs] if in_cycle else values


class TooLarge(LimitReached):
    """There are more states than a certificate is made for."""


def explore(explorer: Explorer) -> None:
    """Explore everything. LimitReached with the reason when that cannot be."""
    graph = explorer.graph
    explorer.explore(MOST_STATES + 1, MOST_STEPS)
    if len(graph) > MOST_STATES:
        raise TooLarge(f"there are more than {MOST_STATES:,} configurations")
    if graph.unfinished is not None:
        raise LimitReached(graph.unfinished)
