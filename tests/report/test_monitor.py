"""What is said and drawn of monitors: verdicts and letters are those of the formula."""

from __future__ import annotations

from itertools import product

import pytest

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.monitoring.properties import Monitored, monitor_properties
from llfsm_verify.report.monitor import LABEL_WIDTH, monitor_graph, summary

ALWAYS = "monitorable: after every word a verdict can still come"
IN_PART = "monitorable in part: there are words after which no verdict can come any more"


def made(line: str) -> Monitored:
    (found,) = parse_properties([Source("t", line)]).properties
    return monitor_properties(found)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("a: G (p -> X q)", ["a: G (p -> X q)", ALWAYS, "3 states: 2 not yet, 1 false"]),
        ("b: F p", ["b: F p", ALWAYS, "2 states: 1 not yet, 1 true"]),
        ("c: G F p", ["c: G F p", "not monitorable: no word gives a verdict"]),
        ("d: true", ["d: true", "decided before anything is read: always true", "1 state: 1 true"]),
        ("h: false", ["h: false", "decided before anything is read: always false", "1 state: 1 false"]),
        ("f: p U q", ["f: p U q", ALWAYS, "3 states: 1 not yet, 1 true, 1 false"]),
        ("forbid g: [p] [q]", ["forbid g: [p] [q]", ALWAYS, "4 states: 3 not yet, 1 false"]),
        (
            "i: (p U q) || G F r",
            ["i: (p U q) || G F r", IN_PART, "3 states: 1 not yet, 1 true, 1 without a verdict forever"],
        ),
    ],
)
def test_a_monitor_in_a_few_lines(line: str, expected: list[str]) -> None:
    assert summary(made(line)).split("\n  ") == expected


@pytest.mark.parametrize("text", ["G (p -> X q)", "F p", "p U q", "(p U q) || G F q", "true"])
def test_a_drawing_reads_words_as_the_monitor_does(text: str) -> None:
    found = made(f"a: {text}")
    graph = monitor_graph(found)
    assert (graph.title, graph.kind) == (f"a: {text}", "machine")
    assert (graph.nodes[0].key, graph.nodes[0].title, graph.nodes[0].kind) == ("start", "", "initial")
    first = graph.edges[0]
    assert (first.source, first.target, first.label, first.kind) == ("start", "s0", "", "start")
    for i, (node, verdict) in enumerate(zip(graph.nodes[1:], found.monitor.verdicts, strict=True)):
        title = "undecidable" if found.monitor.hopeless[i] else verdict.value
        assert (node.key, node.title, node.lines) == (f"s{i}", str(i), (title,))
        assert node.kind == ("state" if verdict.value == "not yet" else "note")
    assert all(edge.kind == "transition" for edge in graph.edges[1:])
    edges = [(e.source, e.target) for e in graph.edges]
    assert len(set(edges)) == len(edges)
    for word in product(product((False, True), repeat=2), repeat=3):
        place, state = "s0", 0
        for given in word:
            letter = frozenset(a for a, true in zip("pq", given, strict=True) if true)
            guards = [(e, parse_formula(Fragment.whole(Source("t", e.label))).formula) for e in graph.edges[1:]]
            ways = [e.target for e, guard in guards if e.source == place and evaluate(guard, (), (letter,))]
            mask = sum(1 << i for i, a in enumerate(found.monitor.atoms) if a in letter)
            (state,) = {e.target for e in found.monitor.edges[state] if e.allows(mask)}
            assert ways == [f"s{state}"]
            place = ways[0]


def test_long_texts_are_cut() -> None:
    atoms = [f"a_rather_long_name_{i}" for i in range(8)]
    graph = monitor_graph(made(f"a: F ({' && '.join(atoms)})"))
    assert len(graph.title) == LABEL_WIDTH == max(len(edge.label) for edge in graph.edges)
