"""What the text and binary formats hold, read back and compared with the structure."""

from __future__ import annotations

import json as decoder
import re
from decimal import Decimal
from io import BytesIO

import networkx as nx
import numpy as np
import pytest
from hypothesis import given

from llfsm_verify.checking.problem import bind
from llfsm_verify.extensions.graphs.aut import aut
from llfsm_verify.extensions.graphs.graphml import graphml
from llfsm_verify.extensions.graphs.npz import npz
from llfsm_verify.extensions.graphs.structure_dot import dot
from llfsm_verify.kripke.export.json import json
from llfsm_verify.kripke.structure import Structure, structure
from llfsm_verify.limits import Budget, Limits
from tests.extensions.checkers.problems import FAST, Problem, counter, explored, model, problem, problems
from tests.outside import load

Edges = set[tuple[int, int, frozenset[str]]]


def edges(found: Structure) -> Edges:
    return {
        (i, int(found.targets[e]), found.letter(e))
        for i in range(found.expanded)
        for e in range(found.indptr[i], found.indptr[i + 1])
    }


def lights() -> Structure:
    found = explored(*model("models/traffic_lights/arrangement.yaml"))
    assert found is not None
    return found


def cut() -> Structure:
    arrangement, lines = model("models/traffic_lights/arrangement.yaml")
    return structure(arrangement, bind(arrangement, lines), budget=Budget(Limits(max_states=40)))


def several_roots() -> Structure:
    board = {"n": {"type": "0..2", "role": "input", "changes": "never"}}
    return structure(*bound(problem(counter("0..2", "x = n;", **board), "G !(x == 2)")))


def decimals() -> Structure:
    """Variables and inputs with digits after the point; `y` has more values than are tried one by one."""
    kind = {"decimal": "0.1", "range": "-1.0..1.0"}
    board = {
        "y": {"type": kind, "role": "input"},
        "z": {"type": {"decimal": "0.1", "range": "0.0..0.1"}, "role": "input"},
    }
    tiny = {"type": {"decimal": "0.00000001", "range": "0.0..1.0"}, "init": "0.00000001"}
    drawn = problem(
        counter({"decimal": "0.01", "range": "-0.5..0.5"}, "x = z - 0.25;", tiny=tiny, **board), "G y < 0.5"
    )
    return structure(*bound(drawn))


def plain(values: dict[str, object]) -> dict[str, object]:
    """Values as JSON and GraphML have them: decimals as floating-point numbers."""
    return {name: float(x) if isinstance(x, Decimal) else x for name, x in values.items()}


def bound(drawn: Problem):
    return drawn[0], bind(*drawn)


# ---------------------------------------------------------------- JSON


@pytest.mark.slow
@FAST
@given(problems())
def test_json(drawn: Problem):
    found = explored(*drawn)
    if found is None:
        return
    back = decoder.loads("".join(json(found)))
    assert back["complete"] is True and back["stopped"] is None and back["atoms"] == list(found.atoms)
    assert [c["values"] for c in back["configurations"]] == [plain(found.values(i)) for i in range(len(found))]
    assert [c["id"] for c in back["configurations"] if c.get("initial")] == found.roots.tolist()
    assert {(e["source"], e["target"], frozenset(e["letter"])) for e in back["edges"]} == edges(found)
    assert len(back["edges"]) == len(found.targets)
    assert all(bool(e.get("steps")) is (back["observe"] == "ringlet") for e in back["edges"])
    assert [f["code"] for f in back["faults"]] == [f.code for f in found.faults]


@pytest.mark.slow
def test_json_of_a_part_says_so():
    back = decoder.loads("".join(json(cut())))
    assert back["complete"] is False and "40 configurations" in back["stopped"]
    assert sum(c.get("expanded") is False for c in back["configurations"]) == len(cut()) - cut().expanded > 0


def test_json_steps():
    back = decoder.loads("".join(json(lights())))
    first = [e for e in back["edges"] if e["source"] == 0]
    assert {(s["machine"], s["state"], s["fired"], s["inputs"]["car"]) for e in first for s in e["steps"]} == {
        ("timer", "NS_PRIORITY", None, False),
        ("timer", "NS_PRIORITY", 0, True),
    }


# ---------------------------------------------------------------- .aut


def read_aut(text: str) -> tuple[int, int, list[tuple[int, str, int]]]:
    """Initial state, number of states and transitions, after the format's definition."""
    lines = text.splitlines()
    initial, transitions, states = map(int, re.fullmatch(r"des \((\d+), (\d+), (\d+)\)", lines[0]).groups())
    rows = [re.fullmatch(r'\((\d+), "([^"]*)", (\d+)\)', line).groups() for line in lines[1:]]
    found = [(int(a), label, int(b)) for a, label, b in rows]
    assert len(found) == transitions
    assert {initial, *(a for a, _, _ in found), *(b for _, _, b in found)} <= set(range(states))
    return initial, states, found


@pytest.mark.slow
@FAST
@given(problems())
def test_aut(drawn: Problem):
    found = explored(*drawn)
    if found is None:
        return
    initial, states, rows = read_aut("".join(aut(found)))
    several = len(found.roots) > 1
    assert states == len(found) + several and initial == (len(found) if several else 0)
    inner = [(a, label, b) for a, label, b in rows if a != len(found)]
    atoms = set(found.atoms)
    expected = sorted(
        (a, "{" + ", ".join(n for n in found.atoms if n in x & atoms) + "}", b) for a, b, x in edges(found)
    )
    assert sorted(inner) == expected


def test_aut_of_several_initial_configurations():
    initial, states, rows = read_aut("".join(aut(several_roots())))
    starts = [row for row in rows if row[0] == initial]
    assert initial == states - 1 and len(starts) == 3 and all(label == "start {}" for _, label, _ in starts)


def test_aut_of_a_part_leads_out_of_it():
    found = cut()
    _, states, rows = read_aut("".join(aut(found)))
    assert [a for a, label, b in rows if label == "CUT SHORT"] == list(range(found.expanded, len(found)))
    assert states == len(found) + 1


def test_aut_without_atoms_says_how_steps_are_taken():
    found = structure(model("models/traffic_lights/arrangement.yaml")[0])
    assert "timer@NS_PRIORITY.0 car=true" in {label for _, label, _ in read_aut("".join(aut(found)))[2]}


# ---------------------------------------------------------------- DOT


@pytest.mark.slow
def test_dot():
    pygraphviz = load("pygraphviz")
    found = lights()
    graph = pygraphviz.AGraph(string="".join(dot(found)))
    nodes = [n for n in graph.nodes() if n.startswith("c")]
    assert len(nodes) == len(found) and graph.number_of_edges() == len(found.targets) + len(found.roots)
    assert "timer@NS_PRIORITY" in graph.get_node("c0").attr["label"]
    part = pygraphviz.AGraph(string="".join(dot(cut())))
    assert "cut short" in part.get_node("cut").attr["label"]


# ---------------------------------------------------------------- GraphML


def test_graphml():
    found = lights()
    graph = nx.read_graphml(BytesIO("".join(graphml(found)).encode()), node_type=int, force_multigraph=True)
    assert len(graph) == len(found) and graph.nodes[0]["ns_light"] == "RED" and graph.nodes[0]["initial"] is True
    assert graph.nodes[0]["c0:ns@RED"] is True
    back = {(a, b, frozenset(n for n in found.propositions if data[n])) for a, b, data in graph.edges(data=True)}
    assert back == edges(found) and all(data["steps"] for _, _, data in graph.edges(data=True))


@pytest.mark.slow
@FAST
@given(problems())
def test_graphml_of_anything(drawn: Problem):
    found = explored(*drawn)
    if found is None:
        return
    graph = nx.read_graphml(BytesIO("".join(graphml(found)).encode()), node_type=int, force_multigraph=True)
    roots = found.roots.tolist()
    for i in range(len(found)):
        first = {f"c0:{n}": n in found.first_letter(roots.index(i)) for n in found.atoms} if i in roots else {}
        assert graph.nodes[i] == {**plain(found.values(i)), "initial": i in roots, "expanded": True, **first}
    back = {(a, b, frozenset(n for n in found.propositions if data[n])) for a, b, data in graph.edges(data=True)}
    assert back == edges(found) and graph.number_of_edges() == len(found.targets)
    assert graph.graph["name"] == found.name and graph.graph["complete"] is True


def test_graphml_of_a_part_says_so():
    found = cut()
    graph = nx.read_graphml(BytesIO("".join(graphml(found)).encode()), node_type=int, force_multigraph=True)
    assert graph.graph["complete"] is False and "40 configurations" in graph.graph["stopped"]
    assert [n for n, x in graph.nodes(data="expanded") if not x] == list(range(found.expanded, len(found)))


# ---------------------------------------------------------------- NPZ


@pytest.mark.slow
@FAST
@given(problems())
def test_npz(drawn: Problem):
    found = explored(*drawn)
    if found is None:
        return
    with np.load(BytesIO(b"".join(npz(found))), allow_pickle=False) as back:
        for name in ("indptr", "targets", "labels", "alphabet", "roots", "first", "keys"):
            assert (back[name] == getattr(found, name)).all() and back[name].dtype == getattr(found, name).dtype
        assert tuple(back["propositions"]) == found.propositions
        for name, field in zip(back["variables"], back["fields"], strict=True):
            word, shift, bits, low, length, per_word = (int(x) for x in field)
            if bits == 64:
                continue
            for k in range(max(length, 1)):  # as docs/kripke.md says
                column = back["keys"][:, word + k // per_word] if bits else np.zeros(len(found), dtype=np.uint64)
                place = np.uint64(shift + bits * (k % per_word))
                values = (column >> place & np.uint64((1 << bits) - 1)).astype(np.int64) + low
                assert (values == found.column(str(name), None if length < 0 else k)).all()
        about = decoder.loads(str(back["about"]))
        assert about["complete"] is True and about["expanded"] == len(found)


# ---------------------------------------------------------------- decimals


@pytest.mark.slow
def test_decimals_are_numbers_in_every_format():
    found = decimals()
    after = {"x": Decimal("-0.15"), "tiny": Decimal("0.00000001")}
    assert after.items() <= found.values(2).items()
    back = decoder.loads("".join(json(found)))
    assert plain(after).items() <= back["configurations"][2]["values"].items()
    steps = [step for edge in back["edges"] for step in edge["steps"]]
    assert {step["inputs"]["z"] for step in steps} == {0.0, 0.1}
    assert {label for step in steps for label in step["labels"]} == {"y in -1.0..0.4", "y in 0.5..1.0"}
    graph = nx.read_graphml(BytesIO("".join(graphml(found)).encode()), node_type=int, force_multigraph=True)
    assert plain(after).items() <= graph.nodes[2].items()
    assert "\\nx = -0.15" in "".join(dot(found)) and "\\ntiny = 0.00000001" in "".join(dot(found))
    assert "z=0.1 y in 0.5..1.0" in "".join(dot(found))


def test_npz_says_how_many_digits_a_decimal_has():
    found = decimals()
    with np.load(BytesIO(b"".join(npz(found))), allow_pickle=False) as back:
        digits = decoder.loads(str(back["about"]))["digits"]
    assert digits == {"x": 2, "tiny": 8}
    assert [Decimal(n).scaleb(-2) for n in found.column("x").tolist()] == [
        found.values(i)["x"] for i in range(len(found))
    ]


def test_enumerators_in_steps_keep_their_case():
    document = counter("0..2", "x = light == RED ? 1 : 2;", light={"type": "Light", "role": "input"})
    found = structure(*bound(problem({**document, "types": {"Light": ["RED", "GREEN"]}})))
    assert '"m@S light=RED"' in "".join(aut(found))


def test_nothing_at_all():
    """One configuration without a variable that takes a bit, and no properties."""
    found = structure(problem(counter("0..0", ""))[0], bind(*problem(counter("0..0", ""))))
    assert decoder.loads("".join(json(found)))["atoms"] == []
    read_aut("".join(aut(found)))
    with np.load(BytesIO(b"".join(npz(found))), allow_pickle=False) as back:
        assert back["alphabet"].shape[1] == 0
