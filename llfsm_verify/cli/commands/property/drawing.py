"""An automaton as a graph for drawing: states are circles, transitions have their letters and acceptance sets."""

from __future__ import annotations

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.logic.formula import to_text
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import Edge, Graph, Node, shorten, summarise

LABEL_WIDTH = 80


def drawing(automaton: Automaton, title: str, wanted: str) -> str | bytes:
    """The automaton in one of `DRAWINGS`; a large one is summarised. DiagnosticError (E406): no library."""
    graph, _ = summarise(automaton_graph(automaton, title))
    return DRAWINGS.load(wanted)(graph)


def automaton_graph(automaton: Automaton, title: str) -> Graph:
    """The graph; a transition in acceptance sets 0 and 2 ends in `{0,2}`."""
    guards = Guards(automaton.atoms)
    nodes = [Node("start", "", (), "initial")]
    nodes += [Node(f"s{q}", str(q), (), "state") for q in range(len(automaton.edges))]
    edges = [Edge("start", "s0", "", "start")] if automaton.edges else []
    for q, row in enumerate(automaton.edges):
        labels: dict[tuple[int, int], list[str]] = {}
        for e in row:
            text = to_text(guards.formula(guards.cube(e.positive, e.negative)))
            labels.setdefault((e.target, e.acceptance), []).append(text)
        for (target, acceptance), cubes in labels.items():
            sets = ",".join(str(k) for k in range(automaton.acceptance_sets) if acceptance >> k & 1)
            label = shorten(" || ".join(cubes), LABEL_WIDTH) + (f" {{{sets}}}" if sets else "")
            edges.append(Edge(f"s{q}", f"s{target}", label, "transition"))
    return Graph(shorten(title, LABEL_WIDTH), tuple(nodes), tuple(edges), "machine")
