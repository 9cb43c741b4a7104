"""A formula that lacks `G` is no proof for any command: it is warned about, fails --strict, and is not guarded."""

from __future__ import annotations

import json

import jsonschema
import pytest

import llfsm_verify as lv
from llfsm_verify.report.schema import load
from tests.cli.running import LIGHTS, llfsm

OVEN = "models/microwave/faulty_R5.yaml"
RED = "b: ns_light == RED"
SAID = "`ns_light == RED` stands under no temporal operator, so it is about the initial configuration only"
PLACE = f"<command line>:1:4: warning[W302]: {SAID}"
MEND = "hint: write `G (ns_light == RED)` if it is to be true throughout, or `initially (ns_light == RED)` if "


@pytest.mark.slow
def test_verify_warns_and_fails_only_under_strict():
    done = llfsm("verify", LIGHTS, "-p", RED, "-q")
    assert done.returncode == 0 and PLACE in done.stderr and MEND in done.stderr
    assert f"note: {SAID}" in llfsm("verify", LIGHTS, "-p", RED).stdout
    strict = llfsm("verify", LIGHTS, "-p", RED, "--strict", "-q")
    assert strict.returncode == 1 and f"fails --strict: {SAID}" in strict.stdout
    assert llfsm("verify", LIGHTS, "-p", RED, "--strict", "-q", "--accept-vacuity", "b").returncode == 0
    meant = llfsm("verify", LIGHTS, "-p", RED.replace(": ", ": initially "), "--strict", "-q")
    assert meant.returncode == 0 and "W302" not in meant.stderr
    assert "b  initially ns_light == RED" in meant.stdout


@pytest.mark.slow
def test_every_engine_has_the_finding():
    for engine in ("explicit", "pdr", "induction"):
        done = llfsm("verify", LIGHTS, "-p", RED, "--strict", "-q", "--engine", engine)
        assert done.returncode == 1 and SAID in done.stdout, engine


@pytest.mark.slow
def test_json_and_sarif_have_it_of_violated_properties_and_assumptions_as_well():
    wrong = ("-p", "a: ns_light == GREEN", "-p", "assume w: !car", "-p", RED)
    value = json.loads(llfsm("verify", LIGHTS, *wrong, "--format", "json").stdout)
    jsonschema.Draft202012Validator(load("result")).validate(value)
    assert [(w["code"], w["line"]) for w in value["warnings"]] == [("W302", 1), ("W302", 2), ("W302", 3)]
    assert [[f["kind"] for f in p["vacuity"]["findings"]] for p in value["properties"]] == [[], ["initial"]]
    log = json.loads(llfsm("verify", LIGHTS, *wrong, "--format", "sarif").stdout)
    assert [r["ruleId"] for r in log["runs"][0]["results"]].count("W302") == 3


@pytest.mark.slow
def test_the_api_has_it():
    model = lv.load(LIGHTS)
    result = model.check(f"{RED}\nc: G (ns_light == RED || true)", strict=True)
    assert result.exit_code == 1
    assert [warning.code for warning in result.warnings] == ["W302"]
    assert [finding.kind for finding in result["b"].vacuity.findings] == ["initial"]
    (warning,) = model.monitor(RED).warnings
    assert warning.message == SAID
    assert not model.monitor(RED.replace(": ", ": G ")).warnings


def test_a_guard_does_not_take_it():
    brakes = ("-p", "brakes: door_open -> !motor")
    done = llfsm("guard", OVEN, *brakes, "--fallback", "motor=false")
    assert done.returncode == 3
    assert "error[E437]: `brakes` cannot be guarded: `door_open` stands under no temporal operator" in done.stderr
    assert "hint: write `G (door_open -> !motor)`" in done.stderr
    listed = llfsm("guard", OVEN, *brakes, "-p", "beginning: initially (door_open -> !motor)", "--list")
    assert listed.returncode == 1
    assert [line.split()[0] for line in listed.stdout.splitlines()] == ["not", "guardable"]
    assert listed.stderr.count("W302") == 1 and "hint: write `G (door_open -> !motor)`" in listed.stderr


@pytest.mark.parametrize("text", ["initially", "initially -> car", "init(car)", "initial && car"])
def test_what_fits_no_arrangement_is_an_error_alone(text):
    done = llfsm("verify", LIGHTS, "-p", f"a: {text}")
    assert done.returncode == 3 and "W302" not in done.stderr
    assert "hint: write `initially" in done.stderr


@pytest.mark.slow
def test_monitors_say_it(tmp_path):
    kept = str(tmp_path / "run.rec")
    run = llfsm("run", LIGHTS, "--simulate", "--seed", "1", "--rate", "0", "--for", "5s", "-p", RED, "--record", kept)
    assert "satisfied: b (in frame 1)" in run.stdout + run.stderr and PLACE in run.stderr
    for command in (
        ("check-recording", kept, "-p", RED),
        ("monitor", RED, "--arrangement", LIGHTS),
        ("monitor", RED),
    ):
        done = llfsm(*command)
        assert f"warning[W302]: {SAID}" in done.stderr, command
        assert "W302" not in llfsm(*(part.replace("b: ", "b: initially ") for part in command)).stderr


def test_initially_vanishes_in_translations():
    for syntax in ("spin", "spot", "nusmv", "llfsm"):
        one = llfsm("property", "print", "--to", syntax, "initially (p -> F q)")
        assert one.stdout == llfsm("property", "print", "--to", syntax, "p -> F q").stdout
        assert one.returncode == 0


def test_a_query_is_not_about_the_beginning():
    done = llfsm("query", LIGHTS, "initially car")
    assert done.returncode == 3 and "error[E345]: `initially` has no meaning in a query" in done.stderr
