"""--strict, --vacuity, --witness and --all, as users run them."""

from __future__ import annotations

import json

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import FAULTY, LIGHTS, PROPERTIES, llfsm

EMPTY = "v: G (ns@GREEN && ew@GREEN -> F car)"
BOTH = "both: G !(ns@GREEN && ew@GREEN)"


@pytest.mark.slow
def test_strict_fails_a_vacuous_property_with_the_reason_in_words():
    done = llfsm("verify", LIGHTS, "-p", EMPTY, "--strict")
    assert done.returncode == 1
    assert "fails --strict: `ns@GREEN && ew@GREEN` is never true in any run" in done.stdout
    assert llfsm("verify", LIGHTS, "-p", EMPTY).returncode == 0
    assert llfsm("verify", LIGHTS, "-p", BOTH, "--strict").returncode == 0


@pytest.mark.slow
def test_a_known_finding_can_be_accepted():
    assert llfsm("verify", LIGHTS, PROPERTIES, "--strict", "-q").returncode == 1
    assert llfsm("verify", LIGHTS, PROPERTIES, "--strict", "-q", "--accept-vacuity", "car_served").returncode == 0
    done = llfsm("verify", LIGHTS, "-p", EMPTY, "--accept-vacuity", "w")
    assert done.returncode == 2 and "--accept-vacuity names no property: w" in done.stderr


@pytest.mark.slow
def test_json_of_everything_is_valid():
    done = llfsm("verify", FAULTY, "-p", BOTH, "-p", EMPTY.replace("v:", "w:"), "-p", "x: G (car -> X (car || !car))",
                 "--strict", "--witness", "--all", "3", "--format", "json")  # fmt: skip
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("result")).validate(value)
    assert done.returncode == value["exit_code"] == 1
    both = value["properties"][0]
    assert len(both["more"]) == 1 and both["only"] is not None
    assert {c["atom"] for c in both["trace"]["steps"][-1]["causes"]} == {"ns@GREEN", "ew@GREEN"}
    assert both["trace"]["steps"][-1]["causes"][0]["variables"] == {"ew": "GREEN"}


@pytest.mark.slow
def test_all_traces_and_witnesses_are_saved_and_can_be_replayed(tmp_path):
    done = llfsm("verify", FAULTY, "-p", BOTH, "-p", "amber: G (ns@GREEN -> ns@GREEN W ns@AMBER)",
                 "--all", "9", "--witness", "--save-traces", str(tmp_path))  # fmt: skip
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["amber.witness.trace.yaml", "both.2.trace.yaml", "both.trace.yaml"]
    assert done.stderr.count("trace saved") == 3
    again = llfsm("replay", *(str(tmp_path / name) for name in names))
    assert again.returncode == 0 and again.stdout.count("the failure still happens") == 2
    assert again.stdout.count("It fails because `ns@GREEN` is true at step") == 2 and "•ns@GREEN" in again.stdout
    assert "expect: holds" in (tmp_path / names[0]).read_text(encoding="utf-8")
