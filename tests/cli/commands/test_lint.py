"""`llfsm lint`: exit codes, places, and the shapes of its reports."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import LIGHTS, llfsm

STROLL = "models/komodo_stroll/arrangement.yaml"
DIVIDES = "models/ball_conditions/faulty_vision.yaml"
SARIF = Path("tests/extensions/servers/sarif/sarif-schema-2.1.0.json")


@pytest.mark.slow
def test_the_dead_transition_of_the_stroll():
    done = llfsm("lint", STROLL)
    first = (
        "models/komodo_stroll/stroll.machine.yaml:11:16: warning[L001]: the transition STROLL -> STOP can never fire"
    )
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines()[0] == first
    assert "2 warnings, 0 notes; 19 configurations, complete" in done.stdout


@pytest.mark.slow
def test_nothing_to_say():
    done = llfsm("lint", LIGHTS)
    assert done.returncode == 0
    assert done.stdout.startswith("0 warnings, 0 notes; 185 configurations, complete")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ((STROLL,), 1),
        ((LIGHTS, "--local"), 0),
        pytest.param((LIGHTS, "--max-states", "5"), 4, marks=pytest.mark.slow),
        pytest.param((DIVIDES,), 1, marks=pytest.mark.slow),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else str(value),
)
def test_json_is_as_the_schema_says(arguments, code):
    done = llfsm("lint", *arguments, "--format", "json")
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("lint")).validate(value)
    assert (done.returncode, value["exit_code"]) == (code, code)
    assert bool(value["unknown"]) == (code == 4)


@pytest.mark.slow
def test_sarif_shows_the_run():
    done = llfsm("lint", DIVIDES, "--format", "sarif")
    log = json.loads(done.stdout)
    jsonschema.Draft7Validator(json.loads(SARIF.read_text())).validate(log)
    results = {r["ruleId"]: r for r in log["runs"][0]["results"]}
    assert results["L008"]["level"] == "warning"
    assert results["L008"]["codeFlows"]


ACCEPTING = """
whiteboard: {n: {type: bool}}
schedule: [m]
machines: {m: {inline: {machine: M, states: [{name: A, internal: n = true;}]}}}
lint: {L010: properties read it}
"""


def test_sarif_suppresses_what_a_file_accepts():
    done = llfsm("lint", "-", "--format", "sarif", stdin=ACCEPTING)
    log = json.loads(done.stdout)
    jsonschema.Draft7Validator(json.loads(SARIF.read_text())).validate(log)
    accepted = [r for r in log["runs"][0]["results"] if r["ruleId"] == "L010"]
    assert [s["kind"] for r in accepted for s in r["suppressions"]] == ["inSource"]


@pytest.mark.slow
def test_runs_are_shown_when_asked_for():
    done = llfsm("lint", DIVIDES, "--traces")
    assert "step  cycle  " in done.stdout
    assert done.stdout.count("Initially") == 1


def test_what_properties_read_is_read():
    text = ACCEPTING.replace("lint:", "# lint:")
    assert "warning[L010]" in llfsm("lint", "-", stdin=text).stdout
    assert llfsm("lint", "-", "-p", "F n", stdin=text).returncode == 0
    assert llfsm("lint", "-", "-p", "F n", stdin=ACCEPTING).returncode == 0


@pytest.mark.parametrize("option", ["--suppressed", "--silenced"])
def test_suppressed_findings_are_shown_when_asked_for(option):
    done = llfsm("lint", "-", option, stdin=ACCEPTING)
    assert "accepted[L010]" in done.stdout
    assert "note: accepted: properties read it" in done.stdout
    assert "accepted[L010]" not in llfsm("lint", "-", stdin=ACCEPTING).stdout


def test_files_in_each_others_place():
    properties = "properties/distance_sensor.ltl"
    assert f"`llfsm lint ARRANGEMENT {properties}`" in llfsm("lint", properties).stderr
    assert "`llfsm lint ARRANGEMENT PROPERTIES`" in llfsm("lint", STROLL, LIGHTS).stderr


def test_wrong_files():
    done = llfsm("lint", "nowhere.yaml", "--format", "json")
    assert done.returncode == 3
    jsonschema.Draft202012Validator(load("lint")).validate(json.loads(done.stdout))
    assert llfsm("lint", "-", "-").returncode == 2
