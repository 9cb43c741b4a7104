"""What can be done with an arrangement besides checking it: ask, lint, run, monitor, explore, draw."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

import llfsm_verify as lv
from tests.outside import needs


def test_an_arrangement(lights):
    assert lights.name == "traffic_lights" and lights.path == "models/traffic_lights/arrangement.yaml"
    assert list(lights.machines) == ["timer", "ns", "ew"] and lights.machines["ns"] == ("RED", "GREEN", "AMBER")
    assert repr(lights) == "<Model traffic_lights: timer, ns, ew>"
    assert lv.load(Path(lights.path)).machines == lights.machines and lights.warnings == ()


def test_wrong_files(tmp_path):
    (tmp_path / "x.yaml").write_text("name: x\nmachins: {}\n")
    with pytest.raises(lv.DiagnosticError) as caught:
        lv.load(tmp_path / "x.yaml")
    assert {d.code for d in caught.value.diagnostics} == {"E033", "E034"}


# ---------------------------------------------------------------- queries


@pytest.mark.slow
def test_queries(lights, tmp_path):
    never = lights.query("ns@GREEN && ew@GREEN")
    assert (never.answer, never.exit_code, never.trace) == (lv.Reachability.UNREACHABLE, 1, None)
    found = lights.query("ew@GREEN")
    assert found.answer == "reached" and found.trace is not None and found.trace.values(-1)["ew"] == "GREEN"
    assert found.trace.because is None and "Violated" not in str(found.trace)
    assert str(found).startswith(f"reached  ew@GREEN  after {len(found.trace)} steps\n")
    assert found.to_dict()["answer"] == "reached" and "ew@GREEN" in found._repr_html_()
    path = found.trace.save(tmp_path / "run.trace.yaml")
    assert str(lv.replay(path)) == "the run still reaches it" and lv.replay(path).as_expected
    cut = lights.query("ns@GREEN && ew@GREEN", "explicit", max_states=3)
    assert cut.answer == "unknown" and cut.reason == "the limit of 3 configurations was reached"
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(cut)
    with pytest.raises(lv.DiagnosticError, match="<query>:1:1: error"):
        lights.query("F ns@GREEN")


# ---------------------------------------------------------------- lint


@pytest.mark.slow
def test_lint(lights, faulty):
    assert len(lights.lint()) == 0 and lights.lint().exit_code == 0
    model = lv.build(
        "x",
        {"m": lv.MachineDefinition("M", {"A": lv.StateDefinition(internal="n = 1;", transitions=[("false", "A")])})},
        whiteboard={"n": {"type": "0..2"}},
    )
    report = model.lint()
    assert {finding.code for finding in report} >= {"L010"} and report.exit_code == 1
    assert [f["code"] for f in report.to_dict()["findings"]] == [f.code for f in report]
    assert "L010" in str(report) and "L010" in report._repr_html_()
    assert "L010" not in {finding.code for finding in model.lint("G n < 2")}
    with pytest.raises(ValueError, match="`local` leaves alone"):
        model.lint(local=True, max_states=3)


# ---------------------------------------------------------------- runs


@pytest.mark.slow
def test_runs_repeat_with_their_seed(lights):
    run = lights.simulate(30, seed=7)
    assert len(run) == 30 and run.seed == 7 and run.ending == "steps"
    assert lights.simulate(30, seed=7) == run
    new = lights.simulate(5)
    assert lights.simulate(5, seed=new.seed) == new
    assert len(lights.simulate()) == 20 and len(lights.simulate(cycles=4, seed=1)) == 12


def test_runs_are_those_of_the_command_line(lights, capsys):
    from llfsm_verify.cli import main

    assert main(["simulate", lights.path, "--cycles", "3", "--set", "car=true", "--seed", "1"]) == 0
    *printed, never = (line.split() for line in capsys.readouterr().out.splitlines())
    run = lights.simulate(cycles=3, seed=1, inputs={"car": True})
    assert run.never_visited == {"timer": ("EW_TURN",), "ns": ("AMBER",), "ew": ("GREEN", "AMBER")}
    assert never == ["Never", "visited:", "timer@EW_TURN,", "ns@AMBER,", "ew@GREEN,", "ew@AMBER."]
    table = [line.split() for line in run.table(fold=False).splitlines()]
    assert table == printed


def test_how_inputs_are_drawn_is_told_as_on_the_command_line(lights):
    always = lights.simulate(cycles=20, seed=1, draw={"car": 1})
    assert {always.inputs(n)["car"] for n in range(1, len(always)) if always.inputs(n)} == {True}
    assert lights.simulate(cycles=20, seed=1, draw={"car": {True: 1.0}}).table() == always.table()
    often, seldom = (lights.simulate(cycles=99, seed=1, hold=hold) for hold in ("none", "1000s"))
    assert len({seldom.inputs(n)["car"] for n in range(1, len(seldom)) if seldom.inputs(n)}) == 1
    assert len({often.inputs(n)["car"] for n in range(1, len(often)) if often.inputs(n)}) == 2
    for wrong, message in (({"hold": 5}, "hold `5` is neither"), ({"draw": {"cra": 0.5}}, "did you mean `car`")):
        for call in (lights.simulate, lights.start, lights.monitor("G ns@RED").start):
            with pytest.raises(ValueError, match=message):
                call(seed=1, **wrong)
        with pytest.raises(ValueError, match=message):
            lights.run(simulate=True, **wrong)
    with pytest.raises(ValueError, match="say how `simulate` draws inputs"):
        lights.run(hold="5s")


def test_inputs_are_held_and_changed(lights):
    run = lights.simulate(20, seed=1, inputs={"car": False}, script={10: {"car": True}})
    sampled = {n: run.inputs(n)["car"] for n in range(1, 21) if run.inputs(n)}
    assert (
        sampled and all(value == (n >= 10) for n, value in sampled.items()) and set(sampled.values()) == {True, False}
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"steps": 0}, "`steps` is a whole number from 1"),
        ({"cycles": "3"}, "`cycles` is a whole number from 1, not '3'"),
        ({"steps": 3, "cycles": 3}, "not both"),
        ({"inputs": {"cars": True}}, "`cars` is not an input of the arrangement; inputs: car"),
        ({"script": {3: {"car": 5}}}, "step 3: car: `5` is neither true nor false"),
    ],
)
def test_wrong_runs(lights, given, message):
    with pytest.raises(ValueError, match=message):
        lights.simulate(**given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"draw": [1]}, "`draw` is a mapping from the names of inputs, not [1]"),
        ({"draw": {1: 0.5}}, "`draw` is a mapping from the names of inputs, not {1: 0.5}"),
        ({"inputs": ["car"]}, "`inputs` is a mapping from the names of inputs, not ['car']"),
        ({"script": [1]}, "`script` is a mapping from the numbers of steps, not [1]"),
        ({"script": {3: "car"}}, "`script[3]` is a mapping from the names of inputs, not 'car'"),
    ],
)
def test_what_is_no_mapping_is_said(lights: lv.Model, given: dict[str, object], message: str) -> None:
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        lights.simulate(**given)  # type: ignore[arg-type]
    if "script" not in given:
        with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
            lights.run(**given)  # type: ignore[arg-type]


def test_how_runs_end():
    counting = lv.StateDefinition(internal="n = n + 1;", transitions=[("n > 2", "A")])
    board = {"n": {"type": "0..2", "init": 0}}
    run = lv.build("x", {"m": lv.MachineDefinition("M", {"A": counting})}, whiteboard=board).simulate(9, seed=1)
    assert (run.ending, len(run), run.fault) == ("fault", 3, "value outside its range: n is declared 0..2")
    once = lv.build(
        "x", {"m": lv.MachineDefinition("M", {"A": lv.StateDefinition(internal="n = 1;")})}, whiteboard=board
    )
    assert (once.simulate(9, seed=1).ending, once.simulate(9, seed=1).values(-1)["n"]) == ("ended", 1)


def test_steps_by_hand(lights):
    simulation = lights.start(seed=1)
    assert simulation.cycle({"car": True}) == 3 and simulation.state("timer") == "CAR_WAITING"
    simulation.run(1000)
    assert simulation.steps == 1003
    with pytest.raises(ValueError, match="there is no input 'cars', only car"):
        simulation.ringlet({"cars": True})


# ---------------------------------------------------------------- monitors


@pytest.mark.slow
def test_monitors_beside_a_run(faulty):
    monitors = faulty.monitor({"both": "G !(ns@GREEN && ew@GREEN)", "served": "G F ns@GREEN"})
    assert [m.name for m in monitors] == ["both", "served"] and len(monitors) == 2
    assert (monitors["both"].monitorability, monitors["served"].monitorability) == ("always", "never")
    assert str(monitors["both"]).startswith("both: G !(ns@GREEN && ew@GREEN)\n  monitorable")
    simulation = monitors.start(seed=1)
    assert simulation.verdicts == {"both": "not yet", "served": "not yet"}
    simulation.run(100_000)
    assert simulation.verdicts["both"] == "false" and simulation.settled["both"] >= 65
    with pytest.raises(KeyError, match="there is no monitor of `x`, only of `both`, `served`"):
        monitors["x"]


def test_monitors_of_recorded_letters(lights):
    monitors = lights.monitor(["both: G !(ns@GREEN && ew@GREEN)", "order: ns@GREEN R !ew@GREEN"])
    reading = monitors.read([{"ns@GREEN"}, {"ns@GREEN": True, "ew@GREEN": True}, set()])
    assert reading.read == 3
    assert reading.verdicts == {"both": "false", "order": "true"} and reading.settled == {"both": 2, "order": 1}
    assert monitors.read([]).verdicts == {"both": "not yet", "order": "not yet"}
    assert monitors.read([["ew@GREEN", "ew@GREEN"]]).verdicts == {"both": "not yet", "order": "false"}
    with pytest.raises(
        ValueError, match=r"letter 2: no property has an atom `car`, only `[en][ws]@GREEN`, `[en][ws]@GREEN`"
    ):
        monitors.read([set(), {"car"}])
    timed = lights.monitor("t: G (car -> F[<=16s] ew@GREEN)")
    with pytest.raises(ValueError, match="bounds in time"):
        timed.read([set()])
    timed.start(seed=1).run(100)


# ---------------------------------------------------------------- structures and drawings


@pytest.mark.slow
def test_the_structure(lights):
    structure = lights.explore("G !(ns@GREEN && ew@GREEN)")
    assert isinstance(structure, lv.Structure)
    assert (len(structure), structure.atoms, structure.complete) == (185, ("ew@GREEN", "ns@GREEN"), True)
    part = lights.explore(max_states=5)
    assert not part.complete and part.stopped == "the limit of 5 configurations was reached"


def test_drawings(lights):
    assert lights.draw().startswith("digraph") and '"ns: Light"' in lights.draw("ns")
    assert "flowchart" in lights.draw("ns", format="mermaid")
    with pytest.raises(ValueError, match="there is no machine `north`; there are: timer, ns, ew"):
        lights.draw("north")
    with pytest.raises(ValueError, match="there is no format of drawings `gif`; there are: dot, mermaid, svg, png"):
        lights.draw(format="gif")


def test_a_simulation_has_the_names_of_users():
    simulation = lv.load("models/level_crossing/arrangement.yaml").start(seed=1)
    simulation.cycle()
    names = "train down up motor lamp env.arrives env.left env.height crossing env"
    assert " ".join(simulation.values) == names
    assert simulation.values["crossing"] == simulation.state("crossing") and simulation.values["env"] == "RUN"


@pytest.mark.slow
def test_runs_are_drawn_on_machines(lights, faulty, tmp_path):
    run = faulty.check("both: G !(ns@GREEN && ew@GREEN)")["both"].trace
    drawn = faulty.draw(trace=run)
    assert "here: violated at step 65" in drawn and "faulty" not in faulty.draw("ns", trace=run)
    assert "traffic_lights" in drawn.splitlines()[0] and "a run of both: G !(ns@GREEN" in drawn.splitlines()[0]
    assert faulty.draw(trace=run.save(tmp_path / "both.trace.yaml")) == drawn
    reached = lights.query("ew@GREEN").trace
    assert "here: reached at step" in lights.draw("ew", trace=reached) and "query: ew@GREEN" in lights.draw(
        trace=reached
    )
    assert "ns: Light, a run" in lights.draw("ns", trace=lights.simulate(cycles=3, seed=1))
    with pytest.raises(ValueError, match="the run is of another arrangement"):
        lights.draw(trace=run)
    text = (tmp_path / "both.trace.yaml").read_text()
    (tmp_path / "other.trace.yaml").write_text(text.replace("choices: {car: true}", "choices: {}"))
    with pytest.raises(lv.DiagnosticError, match=r"E411.*the run does not fit any more"):
        faulty.draw(trace=tmp_path / "other.trace.yaml")


@needs("pygraphviz")
def test_notebooks_draw_where_they_can(lights, monkeypatch):
    assert "<svg" in lights._repr_svg_()
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    assert lights._repr_svg_() is None


@pytest.mark.slow
def test_json_of_answers_is_that_of_the_command_line(lights, capsys):
    from llfsm_verify.cli import main

    main(["query", lights.path, "ew@GREEN", "--format", "json"])
    printed, ours = json.loads(capsys.readouterr().out), lights.query("ew@GREEN").to_dict()
    for value in (printed, ours):
        value.pop("seconds")
    assert ours == printed
