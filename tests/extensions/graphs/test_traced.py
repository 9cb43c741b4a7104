"""A run drawn on its machines: by hand, by the command, and counted over random runs."""

from __future__ import annotations

import random
import re
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Cause, Change, Trace, TraceStep
from llfsm_verify.extensions.graphs.dot import dot
from llfsm_verify.extensions.graphs.mermaid import mermaid
from llfsm_verify.extensions.graphs.pictures import svg
from llfsm_verify.extensions.graphs.traced import DrawnRun, traced_graph
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.drawing.graph import Edge, Graph, Node, with_legend
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.cli.running import llfsm
from tests.outside import load
from tests.quick import AtLeast, examples, spread

LIGHTS = load_arrangement("models/traffic_lights/arrangement.yaml")
AT_FIRST = (("timer", "NS_PRIORITY"), ("ns", "RED"), ("ew", "RED"))


def step(machine: str, state: str, fired: str | None = None, to: str = "") -> TraceStep:
    changes = (Change(machine, state, to),) if to else ()
    return TraceStep("main", machine, state, fired, (), changes, machine == "ew", True, ())


STEPS = (
    step("timer", "NS_PRIORITY"),
    step("ns", "RED", "RED -> GREEN when turn && other@RED", "GREEN"),
    step("ew", "RED"),
    step("timer", "NS_PRIORITY"),
    step("ns", "GREEN"),
    step("ew", "RED"),
)


def drawn(trace: Trace, machine: str = "ns", ending: str = "violated") -> tuple[dict[str, Node], list[Edge]]:
    graph = traced_graph([LIGHTS.machine(machine)], DrawnRun(trace, ending), "title")
    assert dot(graph).startswith("digraph") and mermaid(graph)
    return {node.title: node for node in graph.nodes if node.title}, list(graph.edges)


def test_the_step_that_violates_is_marked_and_what_follows_is_left_out():
    nodes, edges = drawn(Trace(AT_FIRST, (), (), STEPS, 3, failed_at=2))
    assert (nodes["GREEN"].mark, nodes["GREEN"].lines[-1]) == ("violating", "here: violated at step 2")
    assert (nodes["RED"].mark, nodes["RED"].lines[-1]) == ("visited", "step 2")
    assert (nodes["AMBER"].mark, nodes["AMBER"].lines) == ("unvisited", ("on entry: light = AMBER",))
    assert [(e.kind, e.label) for e in edges[:3]] == [
        ("start", ""),
        ("violating", "turn && other@RED\nstep 2"),
        ("untaken", "not turn"),
    ]


def test_other_machines_are_marked_where_a_cause_reads_them():
    cause = Cause("ew@RED", value=True, variables=(("ew", "RED"),))
    marked = (*STEPS[:1], replace(STEPS[1], causes=(cause,)))
    trace = Trace(AT_FIRST, (), (), marked, None, failed_at=2)
    assert (drawn(trace, "ew")[0]["RED"].mark, drawn(trace, "timer")[0]["NS_PRIORITY"].mark) == ("violating", "visited")
    assert drawn(trace, "timer")[0]["NS_PRIORITY"].lines[-1] == "here at step 2"


def test_what_is_violated_at_once_is_marked_where_the_machine_begins():
    cause = Cause("ns@RED", value=True, variables=(("ns", "RED"),))
    nodes, edges = drawn(Trace(AT_FIRST, (), (), STEPS, None, initial_causes=(cause,), failed_at=0))
    assert nodes["RED"].mark == "violating" and nodes["RED"].lines[-1] == "here: violated at first"
    assert {e.kind for e in edges} == {"start", "untaken"}


def test_a_fault_is_marked_in_the_machine_whose_step_it_is():
    site = FaultSite("F001", "too much", LIGHTS.span)
    trace = Trace(AT_FIRST, (), (), STEPS[:5], None, site)
    assert drawn(trace, ending="fault F001")[0]["GREEN"].lines[-1] == "here: fault F001 at step 5"
    assert drawn(trace, "ew")[0]["RED"].mark == "visited"


def test_what_repeats_forever_is_marked():
    nodes, edges = drawn(Trace(AT_FIRST, (), (), STEPS, 3))
    assert nodes["GREEN"].mark == "forever" and nodes["GREEN"].lines[-2:] == ("step 5", "forever")
    assert nodes["RED"].mark == "visited" and edges[1].kind == "taken"
    _, edges = drawn(Trace(AT_FIRST, (), (), STEPS, 1))
    assert (edges[1].kind, edges[1].label) == ("forever", "turn && other@RED\nstep 2, forever")


def test_several_machines_have_titles_and_a_legend():
    graph = traced_graph(LIGHTS.machines, DrawnRun(Trace(AT_FIRST, (), (), STEPS, None), "violated"), "title")
    assert {n.group for n in graph.nodes} == {"timer: Timer", "ns: Light", "ew: Light"}
    assert [n.title for n in with_legend(graph).nodes if n.kind == "caption"] == ["fired", "did not fire"]
    load("pygraphviz")
    texts = [text.replace("\xa0", " ") for text in ET.fromstring(svg(graph)).itertext()]
    shown = [line for node in graph.nodes for line in (node.title, *node.lines) if line]
    shown += [line for edge in graph.edges for line in edge.label.split("\n") if line]
    shown += [node.group for node in graph.nodes if node.kind == "initial"]
    assert Counter([*shown, "fired", "did not fire"]) <= Counter(texts)


def test_an_arrow_to_a_machine_s_suspend_state_is_there_but_not_seen():
    machines = load_arrangement("models/vacuum/arrangement.yaml").texts
    at_first = tuple((machine.name, machine.states[0].name) for machine in machines)
    graph = traced_graph(machines, DrawnRun(Trace(at_first, (), (), (), None), "violated"), "title")
    suspended = [node.key for node in graph.nodes if node.kind == "suspend"]
    hidden = [line.split()[2] for line in dot(graph).splitlines() if line.endswith("[style=invis];")]
    assert suspended and hidden == suspended


def counted(texts: tuple[str, ...]) -> int:
    """How many steps these lines speak of."""
    found = 0
    for text in texts:
        match = re.fullmatch(r"step \d+|steps (\d+(?:, \d+)*)|(\d+) steps, \d+ to \d+", text)
        if match is not None:
            found += int(match[2]) if match[2] else len(match[1].split(",")) if match[1] else 1
    return found


@pytest.mark.slow
def test_every_step_of_a_random_run_is_drawn_once():
    tally: Counter[str] = Counter()

    def check(document: Document, seed: int) -> None:
        arrangement = build_arrangement(document)
        run = RandomRun(Execution(lower(arrangement, keep_all_bits=True)), Script({}), random.Random(seed))
        steps = tuple(run.steps(30, None))
        graph = traced_graph(
            arrangement.texts, DrawnRun(Trace(run.initial, (), (), steps, None, run.fault), "fault"), "t"
        )
        spent = sum(counted(node.lines) for node in graph.nodes)
        fired = sum(counted(tuple(edge.label.split("\n")[1:])) for edge in graph.edges)
        assert spent == len(steps) and fired == sum(each.fired is not None for each in steps)
        _walk(graph)
        tally.update(
            commands=any(n.title == "__suspend" for n in graph.nodes),
            fired=fired > 1,
            frames=len(arrangement.texts) > 1,
        )

    amount = settings(max_examples=examples(30), deadline=None, suppress_health_check=list(HealthCheck))
    least = AtLeast(tally, {"commands": 1, "fired": 3, "frames": 3})
    spread(check, amount, arrangements(), st.integers(0, 1 << 30), until=least)


def _walk(graph: Graph) -> None:
    """What fired joins states where the machine was, and a state that was not visited has no step."""
    marks = {node.key: node.mark for node in graph.nodes}
    for edge in graph.edges:
        if edge.kind in ("taken", "violating"):
            assert "unvisited" not in (marks[edge.source], marks[edge.target])
    assert not any(counted(node.lines) for node in graph.nodes if node.mark == "unvisited")


@pytest.mark.slow
def test_the_command_draws_a_saved_trace(tmp_path: Path) -> None:
    faulty = "models/traffic_lights/faulty.yaml"
    said = ["-p", "m: G !(ns@GREEN && ew@GREEN)", "--engine", "explicit", "-q"]
    assert llfsm("verify", faulty, *said, "--save-traces", str(tmp_path)).returncode == 1
    trace = str(tmp_path / "m.trace.yaml")
    done = llfsm("draw", faulty, "--machine", "ns", "--trace", trace)
    assert (done.returncode, done.stderr) == (0, "") and "here: violated at step 65" in done.stdout
    done = llfsm("draw", "models/traffic_lights/arrangement.yaml", "--trace", trace)
    assert done.returncode == 0 and "does not happen any more" in done.stderr and "violated" not in done.stdout
    Path(trace).write_text(Path(trace).read_text().replace("expect: violated", "expect: holds"))
    done = llfsm("draw", "models/traffic_lights/arrangement.yaml", "--trace", trace)
    assert "note" not in done.stderr and "does not happen" not in done.stderr
    assert "still happens" in llfsm("draw", faulty, "--trace", trace).stderr
    done = llfsm("draw", faulty, "--trace", trace, "--format", "dot", "-o", trace)
    assert done.returncode == 3 and Path(trace).read_text().startswith("# A run of")
    done = llfsm("draw", "tests/outputs/workshop.yaml", "--trace", trace)
    assert done.returncode == 3 and done.stdout == ""
