"""Contradictory assumptions give *unknown*, in all formats and ways; `--allow-contradiction` gives a pass again."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import llfsm_verify as lv
from tests.cli.running import LIGHTS, llfsm

RULES = "assume a: G F car\nassume b: F G !car\nc: G ns@RED\n"
REASON = (
    "no run satisfies the assumptions, so this says nothing: the assumptions contradict each other, "
    "whatever the arrangement"
)
HINT = "correct the assumptions; with `llfsm verify --allow-contradiction` this holds vacuously"


@pytest.fixture
def rules(tmp_path: Path) -> str:
    path = tmp_path / "rules.ltl"
    path.write_text(RULES)
    return str(path)


def ran(rules: str, kind: str, *options: str, code: int) -> str:
    done = llfsm("verify", "--engine", "explicit", LIGHTS, rules, "--format", kind, *options)
    assert done.returncode == code
    return done.stdout


def test_as_text(rules: str) -> None:
    lines = ran(rules, "text", "-q", code=4).splitlines()
    assert lines[:2] == ["unknown  c  G ns@RED", f"            because {REASON}"]
    assert f"hint: {HINT}" in ran(rules, "text", code=4)
    assert ran(rules, "text", "--allow-contradiction", code=0).startswith("holds vacuously  c  G ns@RED\n")
    assert ran(rules, "text", "--strict", "-q", code=4).count(REASON) == 1
    ran(rules, "text", "--strict", "--allow-contradiction", code=1)
    ran(rules, "text", "--strict", "--allow-contradiction", "--accept-vacuity", "c", code=0)


def test_as_json(rules: str) -> None:
    found = json.loads(ran(rules, "json", code=4))
    (item,) = found["properties"]
    assert (item["verdict"], item["words"], item["reason"], found["exit_code"]) == ("unknown", "unknown", REASON, 4)
    assert item["notes"] == [] and [f["kind"] for f in item["vacuity"]["findings"]] == ["assumptions"]
    (item,) = json.loads(ran(rules, "json", "--allow-contradiction", code=0))["properties"]
    assert (item["verdict"], item["words"], item["reason"]) == ("holds", "holds vacuously", None)


def test_as_junit(rules: str) -> None:
    root = ET.fromstring(ran(rules, "junit", code=4))
    (error,) = root.iter("error")
    assert (root.get("errors"), root.get("failures"), error.get("type")) == ("1", "0", "unknown")
    assert error.text == f"{REASON}\nhint: {HINT}"
    assert not list(ET.fromstring(ran(rules, "junit", "--allow-contradiction", code=0)).iter("error"))


def test_as_sarif(rules: str) -> None:
    (run,) = json.loads(ran(rules, "sarif", code=4))["runs"]
    (result,) = run["results"]
    assert (result["ruleId"], result["kind"], result["level"]) == ("unknown", "open", "none")
    assert result["message"]["text"].splitlines()[1:] == [f"N{REASON[1:]}.", f"C{HINT[1:]}."]
    assert run["invocations"][0]["exitCode"] == 4
    (run,) = json.loads(ran(rules, "sarif", "--allow-contradiction", code=0))["runs"]
    assert [(r["ruleId"], r["kind"], r["level"]) for r in run["results"]] == [("empty", "fail", "note")]


def test_of_a_check_beside_an_arrangement(tmp_path: Path) -> None:
    (tmp_path / "one.yaml").write_text(
        "name: one\nwhiteboard: {car: {type: bool, role: input}}\nmachines:\n"
        "  m: {inline: {machine: M, states: [{name: A, transitions: [{when: car, to: A}]}]}}\nschedule: [m]\n"
    )
    (tmp_path / "one.ltl").write_text("assume a: G F car\nassume b: F G !car\nc: G m@A\n")
    done = llfsm("check", str(tmp_path / "one.yaml"))
    assert done.returncode == 4 and f"unknown  c because {REASON}" in done.stdout


def test_on_a_page_for_a_safety_case(rules: str) -> None:
    done = llfsm("report", "--assurance", LIGHTS, rules)
    assert done.returncode == 4
    assert "| c | `G ns@RED` | unknown |" in done.stdout and f"- c is unknown: {REASON}." in done.stdout


def test_from_python() -> None:
    lights = lv.load(LIGHTS)
    found = lights.check(RULES.splitlines(), "explicit")
    assert (found.verdict, found.exit_code, found["c"].reason) == ("unknown", 4, REASON)
    assert lights.check(RULES.splitlines(), "explicit", allow_contradiction=True).verdict == "holds"
