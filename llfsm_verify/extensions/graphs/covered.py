"""Coverage drawn on the machines of an arrangement: told in words and by lines, so that no colour is needed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from llfsm_verify.plug import (
    Arrangement,
    Coverage,
    CoverageStatus,
    DrawnEdge,
    DrawnEdgeKind,
    DrawnMark,
    DrawnNode,
    Graph,
    JudgedGoal,
    Machine,
    machine_graph,
)  # fmt: skip

LEGEND: tuple[tuple[DrawnEdgeKind, str], ...] = (
    ("covered", "covered"),
    ("uncovered", "not covered, reachable"),
    ("unreachable", "unreachable, proved"),
    ("unknown", "unknown"),
)
EDGES: dict[CoverageStatus, DrawnEdgeKind] = {
    "covered": "covered", "reachable": "uncovered", "unreachable": "unreachable", "unknown": "unknown",
}  # fmt: skip
MARKS: dict[CoverageStatus, DrawnMark] = {
    "covered": "visited", "reachable": "uncovered", "unreachable": "unreachable", "unknown": "unknown",
}  # fmt: skip
Place = tuple[str, int, int]
"""A machine, a state, and a transition in it (-1: the state)."""


def coverage_graph(arrangement: Arrangement, found: Coverage) -> Graph:
    """All machines, a group each; a state and a transition say what is known of them, and of guards which outcome and
    which conditions are missing."""
    goals: dict[Place, list[JudgedGoal]] = {}
    for judged in found.goals:
        goal = judged.goal
        goals.setdefault((goal.machine, goal.state, goal.number), []).append(judged)
    nodes: list[DrawnNode] = []
    edges: list[DrawnEdge] = []
    machines = [m for m in arrangement.machines if m.name not in found.modelled]
    for number, machine in enumerate(machines):
        drawn = machine_graph(machine)
        prefix, group = (f"m{number}_", drawn.title) if len(machines) > 1 else ("", "")
        marked = _nodes(machine, drawn, goals)
        nodes += [replace(node, key=prefix + node.key, group=group) for node in marked]
        edges += [
            replace(edge, source=prefix + edge.source, target=prefix + edge.target)
            for edge in _edges(machine, drawn, goals)
        ]
    return Graph(f"{arrangement.name}, coverage", tuple(nodes), tuple(edges), "machine", LEGEND)


def _nodes(machine: Machine, drawn: Graph, goals: Mapping[Place, Sequence[JudgedGoal]]) -> Iterator[DrawnNode]:
    states = {f"s{index}": index for index in range(len(machine.states))}
    for node in drawn.nodes:
        if node.key not in states:
            yield node
            continue
        (judged,) = goals[machine.name, states[node.key], -1]
        yield replace(node, mark=MARKS[judged.status], lines=(*node.lines, _word(judged.status)))


def _edges(machine: Machine, drawn: Graph, goals: Mapping[Place, Sequence[JudgedGoal]]) -> Iterator[DrawnEdge]:
    start, *edges = drawn.edges
    yield start
    places = [(index, number) for index, state in enumerate(machine.states) for number in range(len(state.transitions))]
    for edge, (index, number) in zip(edges, places, strict=True):
        judged = goals[machine.name, index, number]
        taken = next(j for j in judged if j.goal.kind == "transition")
        label = "\n".join([edge.label, _word(taken.status), *_missing(judged)])
        yield replace(edge, kind=EDGES[taken.status], label=label)


def _word(status: CoverageStatus) -> str:
    return "not covered" if status == "reachable" else status


def _missing(judged: Sequence[JudgedGoal]) -> Iterator[str]:
    """Of a guard: what else of it is not covered."""
    for one in judged:
        if one.status == "covered":
            continue
        if one.goal.kind == "branch" and one.goal.outcome is False:
            yield f"false: {_word(one.status)}"
        elif one.goal.kind == "condition":
            yield f"{one.goal.text}: {_word(one.status)}"
