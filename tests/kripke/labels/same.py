"""Graphs of one program with symbolic labels and without, compared."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.labels.labels import Labels
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.program.program import Program

LARGEST, MOST_STEPS = 400, 300_000
"""Configurations of graphs that are compared, and their steps."""


@dataclass(frozen=True)
class Explored:
    """A graph, spelt out: by configuration its edges with the names of what each letter shows."""

    roots: tuple[bytes, ...]
    order: tuple[bytes, ...]
    """Configurations by their numbers."""
    parents: tuple[int, ...]
    edges: dict[bytes, frozenset[tuple[bytes, frozenset[str]]]]
    faults: frozenset[int]
    overflow: bool
    transitions: int
    steps: int


def explored(program: Program, labels: Labels | None) -> Explored | None:
    """None: it is too large."""
    explorer = Explorer(program, Budget(Limits(max_states=LARGEST)), labels=labels)
    try:
        explorer.explore(None, MOST_STEPS)
        graph = explorer.graph
        if graph.stopped is not None:
            return None
        whole = [n for n in range(len(graph)) if not graph.in_cycle(n)]
        edges = {
            graph.key(node): frozenset(
                (graph.key(t), frozenset(n for i, n in enumerate(explorer.observed) if x >> i & 1))
                for t, x in graph.steps(node)
            )
            for node in whole
        }
        return Explored(
            tuple(graph.key(n) for n in range(graph.roots)),
            tuple(graph.key(n) for n in whole),
            tuple(graph.parent(n) for n in range(len(graph))),
            edges,
            frozenset(graph.faults),
            graph.overflow is not None,
            graph.transitions,
            explorer.steps,
        )
    finally:
        explorer.close()


def compared(program: Program, labels: Labels, tally: Counter[str]) -> None:
    """The graph with labels is the graph without: number by number, unless inputs are split together or whole cycles
    are observed."""
    plain, split = explored(program, None), explored(program, labels)
    if plain is None:
        tally["too large"] += 1
        return
    assert split is not None
    assert plain.roots == split.roots
    assert plain.edges == split.edges
    assert plain.faults == split.faults
    assert plain.overflow == split.overflow
    assert plain.transitions == split.transitions
    if program.observe == "ringlet" and not any(len(n.inputs) > 1 for n in labels.notes):
        assert plain.order == split.order
        assert plain.parents == split.parents
        tally["number by number"] += 1
    tally["compared"] += 1
    tally["fewer steps"] += split.steps < plain.steps
