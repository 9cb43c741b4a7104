"""Structures as arrays and as networkx graphs, against the explorer and the executor."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from llfsm_verify.checking.binding import bind
from llfsm_verify.checking.limits import Budget
from llfsm_verify.checking.verdict import Limits
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.steps import Steps
from llfsm_verify.kripke.structure import Structure, structure, structure_of
from llfsm_verify.semantics.lowering import lower
from tests.kripke.export.problems import (
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


@FAST
@given(problems(), st.booleans())
def test_arrays_are_the_explorers_graph(drawn: Problem, keep_all_bits: bool):
    arrangement, lines = drawn
    program = lower(arrangement, bind(arrangement, lines).atoms, keep_all_bits=keep_all_bits)
    explorer = Explorer(program, Budget(Limits(max_states=LARGEST)))
    explorer.explore(None)
    found, graph = structure_of(explorer), explorer.graph
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
    found = structure(arrangement, bind(arrangement, NOTHING), allowance=Budget(Limits(max_states=40)))
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
