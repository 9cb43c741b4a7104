from __future__ import annotations

import math
import re
import struct
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import ACTION_KINDS
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.graphs.dot import dot
from llfsm_verify.extensions.graphs.mermaid import mermaid
from llfsm_verify.extensions.graphs.pictures import PIXELS, png, svg
from llfsm_verify.report.drawing.extract import (
    LINE_WIDTH,
    arrangement_graph,
    commanded,
    machine_graph,
    watched,
    whiteboard_uses,
)
from llfsm_verify.report.drawing.graph import MAX_NODES, Edge, Graph, Node, shorten, summarise, with_legend
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
  note: {type: {array: {record: {kind: Colour, amount: 0..9}}, size: 4}}
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
          internal: if (counts[0] > 1) suspend(a); else if (is_suspended(a)) resume(a); else total += 1;
          transitions: [{when: a@BUSY || a@Suspend, to: ONLY}]
processes: {left: [a], right: [b]}
"""
)


def test_reads_and_writes():
    reads, writes = whiteboard_uses(RICH.machine("a"))
    assert reads == {"go", "total"} and writes == {"lamp", "counts", "total"}
    assert whiteboard_uses(RICH.machine("b")) == ({"counts", "total"}, {"total"})


def test_who_watches_and_commands_whom():
    b = RICH.machine("b")
    assert watched(b, RICH) == {"a": ("@BUSY", "@Suspend", "is_suspended")} and not watched(RICH.machine("a"), RICH)
    assert commanded(b) == {"a": ("suspend", "resume")}
    between = [(e.source, e.target, e.label) for e in GRAPHS["rich"].edges if e.kind in ("watch", "command")]
    assert between == [("m0", "m1", "@BUSY, @Suspend, is_suspended"), ("m1", "m0", "suspend, resume")]


def test_the_legend_explains_the_kinds_of_edges_that_there_are():
    explained = {name: [n.title for n in with_legend(g).nodes if n.kind == "caption"] for name, g in GRAPHS.items()}
    words = ["writes", "reads and writes", "is read by", "commands", "is watched by"]
    assert explained["rich"] == words and not explained["timer"]
    assert explained["lights"] == ["writes", "is read by", "is watched by", "next in the schedule"]


def test_two_directions_between_a_machine_and_a_variable_are_one_edge():
    names = {n.key: n.title for n in GRAPHS["rich"].nodes}
    both = {(names[e.source], names[e.target]) for e in GRAPHS["rich"].edges if e.kind == "both"}
    assert both == {("1. a", "total"), ("1. b", "total")}


def test_a_machine_shows_states_actions_and_the_order_of_guards():
    graph = machine_graph(RICH.machine("a"))
    assert [(n.title, n.kind) for n in graph.nodes] == [
        ("", "initial"),
        ("IDLE", "state"),
        ("BUSY", "state"),
        ("Suspend", "suspend"),
    ]
    assert graph.nodes[1].lines == ("on entry:", "  n = 0;", "  lamp = RED;", "internal: counts[n] = 1")
    assert [e.label for e in graph.edges] == ["", "1: go && total < 3", "2: after_ms(30)", "not go"]
    assert graph.edges[0] == Edge("start", "s0", "", "start")


PLANT = load_arrangement_text(
    """
name: plant
cycle_ms: 10
whiteboard: {power: {type: bool, role: output}, level: {type: 0..9, role: input}, dry: {type: bool, role: input}}
environment:
  inline:
    machine: Tank
    initial: ANY
    states:
      - name: ANY
        on_entry: level = 5; dry = false;
        internal: |
          for (i in 0..1) {
            if (power && level < 9) level++; // it fills

            else if (level > 0) level--;
          }
          dry = power && level == 0 || !power && level == 1 || !power && level == 2; level = dry ? 0 : level;
          int64 a_rather_long_name = level * 1000 + level * 100 + level * 10 + level;
        transitions:
          - {when: not power && level == 3 || power && level == 9 && dry, to: ANY}
schedule: [m]
machines: {m: {inline: {machine: M, states: [{name: ON, on_entry: power = true;, stays: true}]}}}
"""
)


def test_every_line_of_an_action_and_of_a_guard_is_drawn():
    graph = machine_graph(PLANT.plants[0])
    assert graph.nodes[1].lines == (
        "on entry: level = 5; dry = false",
        "internal:",
        "  for (i in 0..1) {",
        "    if (power && level < 9) level++; // it fills",
        "    else if (level > 0) level--;",
        "  }",
        "  dry = power && level == 0 || !power && level == 1",
        "      || !power && level == 2; level = dry ? 0 : level;",
        "  int64 a_rather_long_name = level * 1000 + level * 100 + level",
        "      * 10 + level;",
    )
    assert graph.edges[1].label == "not power && level == 3\n|| power && level == 9 && dry"
    assert "internal:<br/>#160;#160;for (i in 0..1) #123;<br/>#160;#160;#160;#160;if (power" in mermaid(graph)


@pytest.mark.parametrize("path", sorted(Path("models").glob("*/arrangement.yaml")), ids=lambda path: path.parent.name)
def test_no_statement_of_a_model_is_cut(path):
    for machine in load_arrangement(str(path)).texts:
        graph = machine_graph(machine)
        for state, node in zip(machine.states, graph.nodes[1:], strict=True):
            drawn = "".join("".join(node.lines).split())
            statements = [statement for kind in ACTION_KINDS for statement in getattr(state, kind)]
            assert all("".join(statement.span.text.split()) in drawn for statement in statements)
            assert all(len(line) <= LINE_WIDTH for line in node.lines)
        guards = ["".join(t.text.split()) for state in machine.states for t in state.transitions]
        assert [edge.label.split(": ")[-1].replace("\n", "").replace(" ", "") for edge in graph.edges[1:]] == guards


@pytest.mark.parametrize("name", ["level_crossing", "lift", "takeover", "turtle"])
def test_arrows_reach_what_they_lead_to(name):
    load("pygraphviz")
    graph = arrangement_graph(load_arrangement(f"models/{name}/arrangement.yaml"))
    root = ET.fromstring(svg(graph))
    parts = [(g, g.findtext("{*}title")) for g in root.iter("{http://www.w3.org/2000/svg}g")]
    shapes = {title: _points(g)[0] for g, title in parts if g.get("class") == "node" and _points(g)}
    arrows = [(_points(g), title.split("->")) for g, title in parts if title and g.get("class") == "edge"]
    drawn = [(arrow, end) for arrow, ends in arrows for end in ends if end in shapes]
    assert len(drawn) >= 2 * len(graph.edges)
    for arrow, end in drawn:
        distances = [_distance(point, shapes[end]) for points in arrow for point in points]
        assert min(distances) < 4, (name, end)  # a thick line is drawn beyond its end


def _points(group):
    """Those of the polygons, ellipses and paths of a group of an SVG."""
    found = []
    for shape in group.iter():
        if shape.tag.endswith("ellipse"):
            cx, cy, rx, ry = (float(shape.get(key)) for key in ("cx", "cy", "rx", "ry"))
            turns = (math.tau * part / 100 for part in range(100))
            found.append([complex(cx + rx * math.cos(turn), cy + ry * math.sin(turn)) for turn in turns])
        elif shape.tag.endswith(("polygon", "path")):
            text = shape.get("points") or shape.get("d")
            found.append([complex(float(x), float(y)) for x, y in re.findall(r"(-?[\d.]+),(-?[\d.]+)", text)])
    return found


def _distance(point, shape):
    """To the nearest side."""
    sides = [(one, other - one) for one, other in zip(shape, (*shape[1:], shape[0]), strict=True) if one != other]
    along = [max(0.0, min(1.0, ((point - one) * side.conjugate()).real / abs(side) ** 2)) for one, side in sides]
    return min(abs(point - one - part * side) for part, (one, side) in zip(along, sides, strict=True))


def test_an_arrangement_shows_turns_processes_and_the_whiteboard():
    graph = arrangement_graph(LIGHTS)
    turns = [(e.source, e.target) for e in graph.edges if e.kind == "turn"]
    assert turns == [("m0", "m1"), ("m1", "m2"), ("m2", "m0")]
    names = {n.key: n.title for n in graph.nodes}
    reads = {(names[e.source], names[e.target]) for e in graph.edges if e.kind == "read"}
    assert reads == {("car", "1. timer"), ("ns_turn", "2. ns"), ("ew_turn", "3. ew")}
    assert next(n for n in GRAPHS["rich"].nodes if n.title == "note").lines == (
        "array of 4 record {kind: Colour,",
        "amount: 0..9}",
    )
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
    assert sorted(read.nodes()) == sorted(node.key for node in with_legend(graph).nodes)
    assert len(read.edges()) == len(with_legend(graph).edges)
    texts = "".join(ET.fromstring(svg(graph)).itertext()).replace("\xa0", " ")
    for node in with_legend(graph).nodes:
        assert node.title in texts and all(line in texts for line in node.lines)


@pytest.mark.parametrize("name", GRAPHS)
def test_mermaid_has_a_line_for_everything_and_no_loose_markup(name):
    graph = GRAPHS[name]
    lines = mermaid(graph).splitlines()
    assert sum(any(a in line for a in ("-->", "-.->", "-.-o", "==>")) for line in lines) == len(
        with_legend(graph).edges
    )
    for line in lines:
        # Between the quotes of a label nothing may stand that Mermaid would read as its end or as markup.
        inside = line.split('"')[1::2]
        assert all("<" not in text.replace("<b>", "").replace("</b>", "").replace("<br/>", "") for text in inside)
        assert line.count('"') % 2 == 0 or line.startswith("title:")


@pytest.mark.parametrize("draw", [svg, png])
def test_pictures_without_their_library_say_what_to_install(draw, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    with pytest.raises(DiagnosticError) as caught:
        draw(GRAPHS["timer"])
    assert caught.value.diagnostics[0].code == "E406" and "pip install -e '.[draw]'" in str(caught.value)


def test_a_png_is_the_picture_that_the_svg_is():
    load("pygraphviz")
    data = png(GRAPHS["a"])
    assert data.startswith(b"\x89PNG\r\n")
    width, height = struct.unpack(">II", data[16:24])
    root = ET.fromstring(svg(GRAPHS["a"]))
    points = [float(root.attrib[side].removesuffix("pt")) for side in ("width", "height")]
    assert all(
        abs(pixels - point / 72 * PIXELS) <= 2 + pixels // 50
        for pixels, point in zip((width, height), points, strict=True)
    )


def test_a_graph_nobody_can_read_is_summarised():
    nodes = tuple(Node(f"s{i}", f"S{i}", (), "state") for i in range(MAX_NODES + 1))
    graph, note = summarise(Graph("big", nodes, (), "machine"))
    assert len(graph.nodes) == 1 and note is not None and "301 nodes" in note
    assert "301 × state" in dot(graph)
    assert with_legend(graph) == graph
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
