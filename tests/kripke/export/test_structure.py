"""Structures as arrays and as networkx graphs, against the explorer and the executor."""

from __future__ import annotations

import json as decoder
import sys
import tomllib
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.graphs.aut import aut
from llfsm_verify.extensions.graphs.graphml import graphml
from llfsm_verify.extensions.graphs.npz import npz
from llfsm_verify.extensions.graphs.structure_dot import dot
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.export.json import json
from llfsm_verify.kripke.steps import Steps
from llfsm_verify.kripke.structure import Structure, structure, structure_of
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.semantics.lowering import lower
from tests.extensions.checkers.problems import (
    FAST,
    LARGEST,
    MODELS,
    NOTHING,
    Problem,
    counter,
    explored,
    model,
    problem,
    problems,
)

LIGHTS = "models/traffic_lights/arrangement.yaml"


def lights() -> Structure:
    found = explored(*model(LIGHTS))
    assert found is not None
    return found


@pytest.mark.slow
@FAST
@given(problems(), st.booleans())
def test_arrays_are_the_explorers_graph(drawn: Problem, keep_all_bits: bool):
    arrangement, lines = drawn
    program = lower(arrangement, bind(arrangement, lines).atoms, keep_all_bits=keep_all_bits)
    # The structure takes over the memory of its explorer: a second one is compared with it.
    taken, explorer = (Explorer(program, Budget(Limits(max_states=LARGEST))) for _ in range(2))
    for each in (taken, explorer):
        each.explore(None)
    found, graph = structure_of(taken), explorer.graph
    nodes = [n for n in range(len(graph)) if program.observe == "ringlet" or not graph.in_cycle(n)]
    assert [found.keys[i].tobytes() for i in range(len(found))] == [graph.key(n) for n in nodes]
    assert found.complete is graph.complete and (found.stopped is None) is found.complete
    assert len(found.faults) == len(graph.faults)
    number = {n: i for i, n in enumerate(nodes)}
    columns = {
        (v, k): found.column(v, k)
        for v, f in found.layout.fields.items()
        if not f.output
        for k in ([None] if f.length is None else range(f.length))
    }
    event("complete" if found.complete else "cut short")
    for i in range(found.expanded):
        expected = {
            (number[t], frozenset(n for k, n in enumerate(explorer.observed) if x >> k & 1))
            for t, x in graph.steps(nodes[i])
        }
        edges = range(int(found.indptr[i]), int(found.indptr[i + 1]))
        shown = [(int(found.targets[e]), found.letter(e)) for e in edges]
        assert len(set(shown)) == len(shown) and set(shown) == expected
    assert int(found.indptr[-1]) == len(found.targets) == len(found.labels)
    for i in range(len(found)):
        decoded = found.layout.decode(found.keys[i].tobytes())
        for name, value in decoded.items():
            for k, x in enumerate(value) if isinstance(value, tuple) else [(None, value)]:
                assert columns[name, k][i] == x
    for k, letter in enumerate(explorer.first_letters):
        assert found.first_letter(k) == frozenset(n for b, n in enumerate(found.atoms) if letter >> b & 1)
    explorer.close()


def test_values_read_as_users_write_them():
    found = lights()
    values = found.values(0)
    assert values["ns_light"] == "RED" and values["ns_turn"] is True and values["timer.$state"] == "NS_PRIORITY"
    assert values["ns.$clock"] == 0 and values["ns.$clock"] is not False
    array = counter({"array": {"record": {"f": "bool"}}, "size": 2}, "x[0].f = true;")
    found = structure(problem(array)[0])
    assert {"x[0].f", "x[1].f"} <= set(found.values(0)) and found.column("x.f", 0).tolist() == [0, 1]
    with pytest.raises(KeyError):
        found.column("nothing")
    with pytest.raises(IndexError):
        found.column("x.f")


def test_a_graph_of_networkx():
    import networkx as nx

    found = lights()
    graph = found.to_networkx()
    assert len(graph) == len(found) and graph.number_of_edges() == len(found.targets)
    assert graph.nodes[0]["initial"] and "ns@RED" in graph.nodes[0]["letter"] and not graph.nodes[1]["initial"]
    assert set(nx.descendants(graph, 0)) | {0} == set(graph)
    # Mutual exclusion once more, by the graph alone.
    both = {"ns@GREEN", "ew@GREEN"}
    assert not [1 for _, _, letter in graph.edges(data="letter") if both <= letter]
    assert [1 for _, _, letter in graph.edges(data="letter") if "ew@GREEN" in letter]


@pytest.mark.parametrize("path", MODELS)
def test_each_edge_is_taken_in_some_way(path):
    found = explored(*model(path))
    assert found is not None
    steps = Steps(found)
    for i in range(len(found)):
        ways = steps.of(i)
        assert sorted(ways) == list(range(int(found.indptr[i]), int(found.indptr[i + 1])))
        for edge, taken in ways.items():
            assert taken
            for step in taken:
                assert step.machine and (step.fired is None or step.fired >= 0)
                ran = {n for n in found.letter(edge) if n.endswith(".ran")}
                assert ran <= {f"{step.machine}.ran"}
                if "car" in found.atoms:
                    assert all((x is True) is ("car" in found.letter(edge)) for n, x in step.inputs if n == "car")


def test_steps_of_whole_cycles_are_not_known():
    document = {**counter("0..3", "x = (x + 1) % 4;"), "observe": "cycle"}
    found = structure(problem(document)[0])
    assert len(found) == 5 or len(found) == 4
    with pytest.raises(ValueError, match="whole cycles"):
        Steps(found)


def test_cut_short():
    arrangement, _ = model(LIGHTS)
    found = structure(arrangement, bind(arrangement, NOTHING), budget=Budget(Limits(max_states=40)))
    assert not found.complete and "40 configurations" in str(found.stopped)
    assert 0 < found.expanded < len(found)
    assert (np.diff(found.indptr)[found.expanded :] == 0).all() and found.targets.max() < len(found)


def test_without_properties_there_are_no_atoms():
    found = structure(model(LIGHTS)[0])
    assert found.atoms == () and found.alphabet.shape == (1, 0) and found.first.shape == (1, 0)
    assert len(found) == 185


def test_faults_are_named():
    found = structure(problem(counter("0..2", "x++;"))[0])
    assert [f.code for f in found.faults] == ["F001"] and found.values(found.faults[0].configuration)["x"] == 2


def test_without_networkx_it_says_what_to_install(monkeypatch):
    found = lights()
    monkeypatch.setitem(sys.modules, "networkx", None)
    with pytest.raises(DiagnosticError) as caught:
        found.to_networkx()
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "E423" and "`graph`" in str(diagnostic.hint)
    assert "<node" in "".join(graphml(found))  # which needs no networkx


def test_the_extra_graph_is_networkx():
    extras = tomllib.loads(Path("pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert any(r.startswith("networkx") for r in extras["graph"])


# ---------------------------------------------------------------- memory

MANY = 1 << 15


def many(observe: str = "ringlet") -> Explorer:
    document = {**counter(f"0..{MANY - 1}", f"x = (x + 1) % {MANY};"), "observe": observe}
    explorer = Explorer(lower(problem(document)[0], ()), Budget(Limits()))
    explorer.explore(None)
    return explorer


def peak(work: Callable[[], object]) -> int:
    """Bytes that `work` took at once: of Python's objects and of NumPy's arrays."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_structure_takes_over_what_the_exploration_filled():
    explorer = many()
    assert peak(lambda: structure_of(explorer)) < MANY  # a byte a configuration


@pytest.mark.slow
@pytest.mark.parametrize("export", [json, graphml, aut, dot, npz])
def test_a_large_structure_is_written_in_portions(export, monkeypatch):
    found = structure_of(many())
    monkeypatch.setattr("llfsm_verify.kripke.export.rows.STEPS_UPTO", 0)
    monkeypatch.setattr("llfsm_verify.kripke.export.rows.PORTION", 1 << 9)
    monkeypatch.setattr("llfsm_verify.extensions.graphs.npz.PORTION", 1 << 13)

    def write() -> None:
        sizes = [len(piece) for piece in export(found)]
        assert len(sizes) > 50 and max(sizes) < 1 << 17

    assert peak(write) < 20 * MANY  # the text takes up to 250 bytes a configuration, the arrays 24


@pytest.mark.slow
def test_no_configuration_is_written_wrongly_at_the_seams(monkeypatch):
    found = structure_of(many())
    monkeypatch.setattr("llfsm_verify.kripke.export.rows.STEPS_UPTO", 0)
    back = decoder.loads("".join(json(found)))
    assert [(c["id"], c["values"]["x"]) for c in back["configurations"]] == [
        (i, x) for i, x in enumerate(found.column("x").tolist())
    ]
    sources = np.repeat(np.arange(len(found)), np.diff(found.indptr)).tolist()
    assert [(e["source"], e["target"]) for e in back["edges"]] == list(
        zip(sources, found.targets.tolist(), strict=True)
    )


def test_a_limit_may_end_putting_whole_cycles_together():
    explorer = many("cycle")
    assert explorer.graph.complete
    with pytest.raises(LimitReached, match="memory limit"):
        structure_of(explorer, Budget(Limits(memory=1 << 20)))
    explorer.close()


def test_the_arrays_are_read_only():
    found = lights()
    for values in (found.indptr, found.targets, found.labels, found.keys):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0
