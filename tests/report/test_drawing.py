from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest

from llfsm_verify.arrangement import load_arrangement, load_arrangement_text
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.report.drawing.dot import dot
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.graph import MAX_NODES, Edge, Graph, Node, shorten, summarise
from llfsm_verify.report.drawing.mermaid import mermaid
from llfsm_verify.report.drawing.svg import svg
from llfsm_verify.report.drawing.uses import whiteboard_uses
from tests.outside import load

LIGHTS = load_arrangement("models/traffic_lights/arrangement.yaml")

RICH = load_arrangement_text(
    """
name: rich
cycle_ms: 10
types: {Colour: [RED, GREEN]}
whiteboard:
  go: {type: bool, init: false, role: input}
  lamp: {type: Colour, init: RED, role: output}
  counts: {type: {array: 0..3, size: 2}}
  total: {type: 0..9, init: 0}
  spare: {type: bool}
machines:
  a:
    inline:
      machine: A
      variables: {n: {type: 0..3, init: 0}}
      states:
        - name: IDLE
          on_entry: |
            n = 0;
            lamp = RED;
          internal: counts[n] = 1;
          transitions:
            - {when: go && total < 3, to: BUSY}
            - {when: after_ms(30), to: Suspend}
        - name: BUSY
          on_entry: total += 1;
          transitions:
            - {when: not go, to: IDLE}
        - name: Suspend
          on_suspend: lamp = GREEN;
      suspend: Suspend
  b:
    inline:
      machine: B
      states:
        - name: ONLY
          internal: if (counts[0] > 1) suspend(a);
processes: {left: [a], right: [b]}
"""
)


def test_reads_and_writes():
    reads, writes = whiteboard_uses(RICH.machine("a"))
    assert reads == {"go", "total"} and writes == {"lamp", "counts", "total"}
    assert whiteboard_uses(RICH.machine("b")) == ({"counts"}, frozenset())


def test_a_machine_shows_states_actions_and_the_order_of_guards():
    graph = machine_graph(RICH.machine("a"))
    assert [(n.title, n.kind) for n in graph.nodes] == [
        ("", "initial"),
        ("IDLE", "state"),
        ("BUSY", "state"),
        ("Suspend", "suspend"),
    ]
    assert graph.nodes[1].lines == ("on entry: n = 0; lamp = RED", "internal: counts[n] = 1")
    assert [e.label for e in graph.edges] == ["", "1: go && total < 3", "2: after_ms(30)", "not go"]
    assert graph.edges[0] == Edge("start", "s0", "", "start")


def test_an_arrangement_shows_turns_processes_and_the_whiteboard():
    graph = arrangement_graph(LIGHTS)
    turns = [(e.source, e.target) for e in graph.edges if e.kind == "turn"]
    assert turns == [("m0", "m1"), ("m1", "m2"), ("m2", "m0")]
    names = {n.key: n.title for n in graph.nodes}
    reads = {(names[e.source], names[e.target]) for e in graph.edges if e.kind == "read"}
    assert reads == {("car", "1. timer"), ("ns_turn", "2. ns"), ("ew_turn", "3. ew")}
    assert {n.group for n in arrangement_graph(RICH).nodes} == {"process left", "process right", ""}


GRAPHS = {
    "lights": arrangement_graph(LIGHTS),
    "timer": machine_graph(LIGHTS.machine("timer")),
    "rich": arrangement_graph(RICH),
    "a": machine_graph(RICH.machine("a")),
    "awkward": Graph(
        'quote " back\\ <b>&amp;',
        (Node("s0", 'a "b" \\n', ('x = "<y>" | z; #35;', "1: a[0] --> b"), "state"),),
        (Edge("s0", "s0", 'a "<" \\ b | c', "transition"),),
        "machine",
    ),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_graphviz_reads_what_is_written(name):
    pygraphviz = load("pygraphviz")
    graph = GRAPHS[name]
    read = pygraphviz.AGraph(string=dot(graph))
    assert sorted(read.nodes()) == sorted(node.key for node in graph.nodes)
    assert len(read.edges()) == len({(e.source, e.target, i) for i, e in enumerate(graph.edges)})
    texts = "".join(ET.fromstring(svg(graph)).itertext()).replace("\xa0", " ")
    for node in graph.nodes:
        assert node.title in texts and all(line in texts for line in node.lines)


@pytest.mark.parametrize("name", GRAPHS)
def test_mermaid_has_a_line_for_everything_and_no_loose_markup(name):
    graph = GRAPHS[name]
    lines = mermaid(graph).splitlines()
    assert sum("-->" in line or "-.->" in line for line in lines) == len(graph.edges)
    for line in lines:
        # Between the quotes of a label nothing may stand that Mermaid would read as its end or as markup.
        inside = line.split('"')[1::2]
        assert all("<" not in text.replace("<b>", "").replace("</b>", "").replace("<br/>", "") for text in inside)
        assert line.count('"') % 2 == 0 or line.startswith("title:")


def test_svg_without_its_library_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    with pytest.raises(DiagnosticError) as caught:
        svg(GRAPHS["timer"])
    assert caught.value.diagnostics[0].code == "E406" and "pip install 'llfsm-verify[draw]'" in str(caught.value)


def test_a_graph_nobody_can_read_is_summarised():
    nodes = tuple(Node(f"s{i}", f"S{i}", (), "state") for i in range(MAX_NODES + 1))
    graph, note = summarise(Graph("big", nodes, (), "machine"))
    assert len(graph.nodes) == 1 and note is not None and "301 nodes" in note
    assert "301 × state" in dot(graph)
    assert summarise(GRAPHS["timer"]) == (GRAPHS["timer"], None)


def test_long_texts_are_cut():
    assert shorten("a  b\nc") == "a b c" and len(shorten("x" * 100)) == 48


@pytest.mark.slow
def test_the_command_writes_a_file(tmp_path):
    target = tmp_path / "ns.mmd"
    command = [
        sys.executable,
        "-m",
        "llfsm_verify",
        "draw",
        "models/traffic_lights/arrangement.yaml",
        "--machine",
        "ns",
    ]
    done = subprocess.run([*command, "-o", str(target)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "") and target.read_text().startswith('---\ntitle: "ns: Light"')
    done = subprocess.run([*command[:-1], "west"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "there are timer, ns, ew" in done.stderr
