from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.extensions.servers.flows import MAX_STEPS
from llfsm_verify.extensions.servers.sarif import failure_sarif
from llfsm_verify.extensions.servers.sarif import report as result_sarif
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.cli.running import COUNTER, FAULTY, llfsm
from tests.report.results import ALL, BAD, LASSO, STRICT
from tests.report.results import result as result_of

BOTH = "both: G !(ns@GREEN && ew@GREEN)"


@cache
def schema() -> Draft7Validator:
    return Draft7Validator(
        json.loads(Path(__file__).with_name("sarif").joinpath("sarif-schema-2.1.0.json").read_text())
    )


def run_of(text: str) -> dict:
    """The one run of a log that is valid."""
    log = json.loads(text)
    schema().validate(log)
    (run,) = log["runs"]
    for result in run["results"]:
        assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == result["ruleId"]
    return run


def faulty(properties: str):
    arrangement = load_arrangement(FAULTY)
    return verify(arrangement, parse_properties([Source("lights.ltl", properties)]), Options()), arrangement


def by_hand():
    """An arrangement with the machines of the results made by hand."""
    arrangement = load_arrangement(FAULTY)
    first, second, _ = arrangement.machines
    return replace(arrangement, machines=(replace(first, name="m"), replace(second, name="n")))


def test_the_schema_refuses_what_is_none():
    assert not schema().is_valid({"version": "2.1.0", "runs": [{"results": []}]})


def test_a_violation_stands_at_its_line_and_flows_through_the_guards_that_fired():
    run = run_of(result_sarif(*faulty(f"# lights\n{BOTH}\nfine: G (car -> F ns@GREEN)\n")))
    (result,) = run["results"]
    assert (result["ruleId"], result["level"]) == ("violated", "error")
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "lights.ltl", "uriBaseId": "%SRCROOT%"}
    assert place["region"] == {"startLine": 2, "startColumn": 7, "endLine": 2, "endColumn": 32}
    (flow,) = result["codeFlows"][0]["threadFlows"]
    steps = {step["executionOrder"]: step["location"] for step in flow["locations"]}
    assert list(steps) == sorted(steps) and max(steps) == 65
    for number, file, text in ((1, "timer", "car"), (2, "hasty_light", "turn"), (35, "hasty_light", "not turn")):
        physical = steps[number]["physicalLocation"]
        path, region = Path(physical["artifactLocation"]["uri"]), physical["region"]
        assert path == Path(f"models/traffic_lights/{file}.machine.yaml")
        line = path.read_text().splitlines()[region["startLine"] - 1]
        assert line[region["startColumn"] - 1 : region["endColumn"] - 1] == text
    assert "NS_PRIORITY" in steps[1]["message"]["text"] and "car = true" in steps[1]["message"]["text"]


def test_a_violation_says_why_and_every_counterexample_is_a_flow():
    run = run_of(result_sarif(STRICT, by_hand()))
    (violated,) = [r for r in run["results"] if r["ruleId"] == "violated"]
    assert "It fails because `x == 3` is true at step 9." in violated["message"]["text"]
    assert "There is no third." in violated["message"]["text"]
    flows = violated["codeFlows"]
    assert [flow["message"]["text"][:11] for flow in flows] == ["Run 1 of 2:", "Run 2 of 2:"]
    last = flows[1]["threadFlows"][0]["locations"][-1]
    assert "•x == 3" in last["location"]["message"]["text"] and last["importance"] == "essential"


@pytest.mark.parametrize(("strict", "level"), [(True, "error"), (False, "note")])
def test_an_empty_pass_is_a_result_and_fails_with_strict(strict, level):
    run = run_of(result_sarif(replace(STRICT, strict=strict), by_hand()))
    results = {r["message"]["text"].split()[0]: r for r in run["results"]}
    assert results.keys() == {"empty", "known", "twice"} | ({"unseen"} if strict else set())
    assert (results["empty"]["ruleId"], results["empty"]["level"]) == ("empty", level)
    assert "is never true in any run" in results["empty"]["message"]["text"]
    # What somebody has accepted is no failure any more.
    assert results["known"]["level"] == "note" and results["known"]["suppressions"]
    if strict:
        assert (results["unseen"]["ruleId"], results["unseen"]["kind"]) == ("unknown", "open")
        (note,) = run["invocations"][0]["toolExecutionNotifications"]
        assert "not checked for vacuity" in note["message"]["text"]


def test_very_many_counterexamples_have_a_start_and_an_end_each(monkeypatch):
    monkeypatch.setattr("llfsm_verify.extensions.servers.flows.MAX_STEPS", 3)
    many = replace(BAD, more=(BAD.trace,) * 4)
    (found,) = run_of(result_sarif(result_of(many), by_hand()))["results"]
    assert [len(flow["threadFlows"][0]["locations"]) for flow in found["codeFlows"]] == [2] * 5


def test_what_is_forbidden_is_said_to_be():
    forbidden = replace(BAD, kind="forbid", text="x == 3")
    (found,) = run_of(result_sarif(result_of(forbidden), by_hand()))["results"]
    assert "bad is violated (assuming fair): forbid x == 3\n" in found["message"]["text"]


@pytest.mark.slow
def test_a_fingerprint_stays_where_lines_move_and_changes_with_the_property():
    def fingerprint(text: str) -> str:
        return run_of(result_sarif(*faulty(text)))["results"][0]["partialFingerprints"]["llfsm/v1"]

    first = fingerprint(BOTH)
    assert fingerprint(f"\n\n{BOTH}") == first
    assert fingerprint(BOTH.replace("!(", "! (")) != first


def test_what_is_unknown_is_open_and_told():
    run = run_of(
        llfsm("verify", FAULTY, "-p", BOTH, "--engine", "explicit", "--max-states", "5", "--format", "sarif").stdout
    )
    assert [(r["kind"], r["level"]) for r in run["results"]] == [("open", "none")]
    (invocation,) = run["invocations"]
    assert invocation["exitCode"] == 4 and len(invocation["toolExecutionNotifications"]) == 2


def test_a_fault_stands_at_the_line_that_raises_it(tmp_path, monkeypatch):
    (tmp_path / "my counter.yaml").write_text(COUNTER)
    monkeypatch.chdir(tmp_path)
    done = llfsm("verify", "my counter.yaml", "--format", "sarif")
    result = run_of(done.stdout)["results"][0]
    assert done.returncode == 1 and result["ruleId"] == "F001" and result["codeFlows"]
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "my%20counter.yaml"


def test_wrong_files_are_results_too(tmp_path):
    done = llfsm("verify", FAULTY, "-p", "p: G !(ns@GREN)", "--format", "sarif")
    run = run_of(done.stdout)
    assert done.returncode == 3 and "E112" in done.stderr
    assert [r["ruleId"] for r in run["results"]] == ["E112"] and not run["invocations"][0]["executionSuccessful"]
    missing = run_of(llfsm("verify", str(tmp_path / "gone.yaml"), "--format", "sarif").stdout)
    assert missing["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"].startswith("file:///")


def test_warnings_and_results_made_by_hand_are_valid():
    arrangement = load_arrangement(FAULTY)
    source = Source("a.yaml", "é: 1\n")
    warned = replace(arrangement, warnings=(Diagnostic("W001", "never used", Span(source, 0, 1), ("why",), "what"),))
    hand = replace(
        ALL,
        properties=tuple(replace(p, trace=p.trace and replace(LASSO, steps=(), loop=None)) for p in ALL.properties),
        faults=replace(ALL.faults, findings=()),
    )
    run = run_of(result_sarif(hand, warned))
    assert "W001" in [r["ruleId"] for r in run["results"]]
    assert run_of(failure_sarif([Diagnostic("E001", "nothing")], 3))["results"][0].get("locations") is None


@pytest.mark.long
def test_a_long_run_is_cut_in_the_middle():
    result, arrangement = faulty(BOTH)
    (item,) = result.properties
    changing = [step for step in item.trace.steps if step.changes]
    long = replace(item, trace=replace(item.trace, steps=tuple(changing * MAX_STEPS), failed_at=None))
    (found,) = run_of(result_sarif(replace(result, properties=(long,)), arrangement))["results"]
    assert len(found["codeFlows"][0]["threadFlows"][0]["locations"]) == MAX_STEPS
    assert "leaves out" in found["message"]["text"]
