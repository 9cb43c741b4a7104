"""Whether every run ends: verdicts are then about a few steps, which is worth a line to those who meant to go on."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.program.program import Program

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
