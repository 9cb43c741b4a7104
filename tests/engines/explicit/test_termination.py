"""Arrangements whose every run ends are said to be such, with the length of the longest run."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import pytest
from hypothesis import event, given, settings

from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit.explored import longest_run
from llfsm_verify.kripke.structure import structure
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.plain import plain_text
from llfsm_verify.report.text import result_text
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many

ENDING = """
whiteboard: {go: {type: bool, role: input}}
machines:
  a: {inline: {machine: A, states: [{name: A, transitions: [{when: go, to: B}]}, {name: B}]}}
  b: {inline: {machine: B, states: [{name: A, transitions: [{when: TRUE, to: B}]}, {name: B}]}}
schedule: [a, b]
"""


def anything() -> PropertySet:
    return parse_properties([Source("p", "a: G true")])


@pytest.mark.parametrize(("text", "longest"), [
    (ENDING, None),
    (ENDING.replace("when: go", "when: 'true'"), 4),
    (ENDING.replace("{when: go, to: B}", "{when: go, to: B}, {when: 'true', to: B}"), 4),
    ("machines: {m: {inline: {machine: M, states: [{name: S}]}}}\nschedule: [m]\n", 1),
    ("finished: keep\nmachines: {m: {inline: {machine: M, states: [{name: S}]}}}\nschedule: [m]\n", 1),
])  # fmt: skip
def test_it_is_known_which_end(text: str, longest: int | None) -> None:
    assert ended(load_arrangement_text(text.replace("TRUE", "'true'"))) == longest


def ended(arrangement: Arrangement) -> int | None:
    result = verify(arrangement, anything(), engine="explicit")
    said = [line for line in plain_text(result_text(result)).splitlines() if line.startswith("every run ends")]
    assert len(said) == (result.exploration.longest is not None)
    assert not said or f"after at most {result.exploration.longest} step" in said[0]
    return result.exploration.longest


def by_networkx(arrangement: Arrangement) -> int | None:
    """The same by the values of configurations and a library's longest path; the rows of a trace are ringlets."""
    arrangement = replace(arrangement, observe="ringlet")
    found = structure(arrangement, bind(arrangement, anything()))
    graph = nx.DiGraph(found.to_networkx())
    for node in range(len(found)):
        flags = [value for name, value in found.values(node).items() if name.endswith(".$ended")]
        if len(flags) == len(arrangement.processes) and all(flags):
            graph.remove_edge(node, node)
    return nx.dag_longest_path_length(graph) if nx.is_directed_acyclic_graph(graph) else None


def compared(document: Document) -> None:
    arrangement = build_arrangement(document)
    result = verify(arrangement, anything(), Options(Limits(max_states=2_000)), engine="explicit")
    if not result.complete or result.faults.findings:
        event("not complete")
        return
    event("ends" if result.exploration.longest is not None else "goes on")
    assert result.exploration.longest == by_networkx(arrangement)


@pytest.mark.slow
@settings(max_examples=examples(40))
@given(arrangements(max_machines=2, max_states=3))
def test_a_library_finds_the_same(document: Document) -> None:
    compared(document)


@pytest.mark.long
@settings(max_examples=many(2_000))
@given(arrangements(max_machines=3, max_states=3))
def test_a_library_finds_the_same_many(document: Document) -> None:
    compared(document)


def test_large_graphs_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{longest_run.__module__}.MOST", 1)
    assert ended(load_arrangement_text(ENDING.replace("when: go", "when: 'true'").replace("TRUE", "'true'"))) is None
