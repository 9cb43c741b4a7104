"""Coverage of small arrangements, whose goals are counted by hand, and of files of runs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml
from jsonschema import validate

import llfsm_verify as lv
from llfsm_verify.analysis.coverage.measure import coverage
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.limits import Limits
from llfsm_verify.report.schema import SCHEMAS
from llfsm_verify.runtime.recording.file import Recording
from tests.cli.running import llfsm

COUPLED = {
    "name": "coupled",
    "cycle_ms": "100",
    "whiteboard": {"x": {"type": "0..9", "role": "input"}, "n": {"type": "0..3"}},
    "machines": {
        "m": {
            "inline": {
                "machine": "M",
                "states": [
                    {
                        "name": "A",
                        "on_entry": "n = 1;",
                        "transitions": [{"when": "x > 3 || x > 5", "to": "B"}, {"when": "n == 0", "to": "B"}],
                    },
                    {"name": "B", "internal": "if (x > 3 && x > 5) { n = 2; }", "stays": True},
                    {"name": "C", "stays": True},
                ],
            }
        }
    },
    "schedule": ["m"],
}


def write(name: str, document: dict[str, object]) -> None:
    Path(name).write_text(yaml.safe_dump(document, sort_keys=False))


def statuses(found) -> dict[tuple[str, str, bool | None], str]:
    return {(j.goal.kind, j.goal.text, j.goal.outcome): j.status for j in found.goals}


PLANT = """
name: guarded
whiteboard: {low: {type: bool, role: input}, high: {type: bool, role: input}}
environment:
  inline: {machine: World, states: [{name: W, internal: "high = low; low = true;"}]}
machines:
  m: {inline: {machine: M, states: [{name: A, transitions: [{when: high and not low, to: B}]}, {name: B}]}}
schedule: [m]
"""


@pytest.mark.slow
def test_what_is_unreachable_is_so_with_a_plant_that_is_named(tmp_path):
    path = tmp_path / "guarded.yaml"
    path.write_text(PLANT)
    done = llfsm("coverage", str(path))
    assert "\nUnreachable, by all configurations with env as modelled:\n" in done.stdout
    assert "\nmodel of the surroundings, without which more may be reachable: env\n" in done.stdout
    document = json.loads(llfsm("coverage", str(path), "--format", "json").stdout)
    assert document["surroundings"] == "env"
    validate(document, SCHEMAS.load("coverage")("coverage"))
    path.write_text(re.sub("environment:\n.*\n", "", PLANT))
    done = llfsm("coverage", str(path))
    assert "Unreachable" not in done.stdout, "the plant made it so"
    assert "model" not in done.stdout
    document = json.loads(llfsm("coverage", str(path), "--format", "json").stdout)
    assert document["surroundings"] is None


@pytest.mark.slow
def test_a_pair_around_unequal_has_equal_values_of_the_other_side():
    guard = {"when": "(a != b) != c", "to": "B"}
    states = [{"name": "A", "on_entry": "a = i; b = j; c = i;", "transitions": [guard]},
              {"name": "B", "transitions": [{"when": "true", "to": "A"}]}]  # fmt: skip
    whiteboard = {**{name: {"type": "bool", "role": "input"} for name in "ij"},
                  **{name: {"type": "bool"} for name in "abc"}}  # fmt: skip
    document = {**COUPLED, "whiteboard": whiteboard, "machines": {"m": {"inline": {"machine": "M", "states": states}}}}
    found = statuses(coverage(build_arrangement(document)))
    assert [found["condition", name, None] for name in "abc"] == ["unreachable", "reachable", "reachable"]


@pytest.mark.slow
def test_coupled_conditions_are_proved_impossible():
    found = statuses(coverage(build_arrangement(COUPLED)))
    # Where `x > 5` is true `x > 3` is true as well, so it never decides alone; in the `if` both do.
    assert found["condition", "x > 5", None] == "reachable"
    both = [j.status for j in coverage(build_arrangement(COUPLED)).goals if j.goal.kind == "condition"]
    assert both == ["reachable", "unreachable", "reachable", "reachable"]
    # `on_entry` runs before the guard is evaluated, so `n == 0` is never true there.
    assert found["branch", "n == 0", True] == "unreachable"
    assert found["branch", "n == 0", False] == "reachable"
    assert found["transition", "A -> B when n == 0", None] == "unreachable"
    assert found["state", "C", None] == "unreachable"


def test_what_a_limit_leaves_is_unknown():
    found = coverage(build_arrangement(COUPLED), limits=Limits(max_states=1))
    assert not found.complete
    assert {j.status for j in found.goals} == {"unknown", "reachable"}
    assert found.exit_code == 4


def test_runs_are_shortest_and_say_their_inputs():
    found = coverage(build_arrangement(COUPLED))
    entered = next(j for j in found.goals if (j.goal.kind, j.goal.text) == ("state", "B"))
    (run,) = entered.runs
    assert len(run) == 2
    assert int(dict(run[0].choices)["x"]) > 3


@pytest.mark.slow
def test_traces_and_recordings_add_up(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    assert llfsm("run", "a.yaml", "--rate", "0", "--for", "1s", "--set", "x=9", "--record", "high.rec").returncode == 0
    assert llfsm("verify", "a.yaml", "-p", "stay: G m@A", "--save-traces", ".").returncode == 1
    model = lv.load("a.yaml")
    alone, together = model.coverage("high.rec"), model.coverage("high.rec", "stay.trace.yaml")
    seen = [{j.goal for j in report.wrapped.of("covered")} for report in (alone, together)]
    assert seen[0] <= seen[1]
    assert statuses(alone.wrapped)["branch", "x > 3 && x > 5", True] == "covered"
    assert statuses(alone.wrapped)["branch", "x > 3 || x > 5", False] == "reachable"
    assert alone.exit_code == 1
    done = llfsm("coverage", "a.yaml", "high.rec")
    assert done.returncode == 1
    assert "decides alone in `x > 3 || x > 5`" in done.stdout and "high.rec: 10 ringlets" in done.stdout


def test_the_object_fits_its_schema():
    from llfsm_verify.report.coverage import coverage_object

    validate(coverage_object(coverage(build_arrangement(COUPLED))), SCHEMAS.load("coverage")("coverage"))


def test_runs_of_others_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    write("b.yaml", {**COUPLED, "cycle_ms": "200"})
    assert llfsm("run", "a.yaml", "--rate", "0", "--for", "1s", "--record", "a.rec").returncode == 0
    done = llfsm("coverage", "b.yaml", "a.rec")
    assert (done.returncode, "E520" in done.stderr) == (3, True)


def test_damaged_recordings_are_refused_and_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    assert llfsm("run", "a.yaml", "--rate", "0", "--for", "1s", "--set", "x=9", "--record", "a.rec").returncode == 0
    whole = Path("a.rec").read_bytes()
    with Recording("a.rec") as recording:
        frames = sum(1 for _ in recording)
    Path("a.rec").write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    done = llfsm("coverage", "a.yaml", "a.rec")
    assert (done.returncode, done.stdout) == (3, "")
    assert (
        f"error[E521]: the recording is damaged after frame {frames - 1}: the next frame is not the one" in done.stderr
    )
    done = llfsm("check-recording", "a.rec", "-p", "F m@A")
    assert (done.returncode, "a.rec: damaged after what was decided on: the next frame" in done.stderr) == (0, True)
    Path("a.rec").write_bytes(whole + b"more")
    done = llfsm("coverage", "a.yaml", "a.rec")
    assert (done.returncode, "something was appended to it" in done.stderr) == (3, True)
    done = llfsm("check-recording", "a.rec", "-p", "F m@A")
    assert (done.returncode, "something was appended to it" in done.stderr) == (0, True)


@pytest.mark.slow
def test_a_drawing_says_in_words_what_is_covered(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    assert llfsm("run", "a.yaml", "--rate", "0", "--for", "1s", "--record", "a.rec").returncode == 0
    assert llfsm("coverage", "a.yaml", "a.rec", "--draw", "a.dot").returncode == 1
    lines = Path("a.dot").read_text().splitlines()
    (taken,) = (line for line in lines if "s0 -> s1" in line and "x &gt; 5" in line)
    assert "not covered" in taken and "style=dashed" in taken
    (never,) = (line for line in lines if "s0 -> s1" in line and "n == 0" in line)
    assert "unreachable" in never and "style=dotted" in never
    (state,) = (line for line in lines if line.startswith("  s0 ["))
    assert "covered" in state and "not covered" not in state
    done = llfsm("coverage", "a.yaml", "--draw", "a.yaml")
    assert (done.returncode, "no drawing ends like" in done.stderr) == (2, True)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lift", "line_follower", "komodo_stroll"])
def test_an_engine_agrees_on_states(name):
    model = lv.load(f"models/{name}/arrangement.yaml")
    checked = set[str]()
    for judged in model.coverage():
        goal = judged.goal
        asked = f"{goal.machine}@{goal.text} && {goal.machine}.ran"
        if goal.kind == "state" and (judged.status not in checked or judged.status == "unreachable"):
            checked.add(judged.status)
            reached = model.query(asked, "explicit").answer == "reached"
            assert reached == (judged.status == "reachable"), goal
    assert "reachable" in checked
