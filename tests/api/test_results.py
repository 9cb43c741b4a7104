"""Results: verdicts by name, what a check says, and the forms in which it is read."""

from __future__ import annotations

import json
from enum import StrEnum

import jsonschema
import pytest

import llfsm_verify as lv
from llfsm_verify.report.schema import SCHEMAS


def test_a_verdict_is_a_word(result):
    assert isinstance(result["both"].verdict, StrEnum)
    assert result["both"].verdict is lv.Verdict.VIOLATED
    assert f"{result['both'].verdict} {result['served'].verdict}" == "violated holds"
    assert result["served"].verdict == "holds"


def test_the_whole_check(result, lights):
    assert result.verdict is lv.Verdict.VIOLATED and result.exit_code == 1
    assert [outcome.name for outcome in result] == ["both", "served", "dead"]
    assert len(result) == 3 and "both" in result and "other" not in result
    assert (result.complete, result.states, result.engine, result.interrupted) == (True, 173, "explicit", False)
    assert lights.check().verdict == "holds" and len(lights.check()) == 0


def test_unknown_is_neither(lights):
    cut = lights.check("a: G !(ns@GREEN && ew@GREEN)", "explicit", max_states=3)
    assert (cut.verdict, cut["a"].verdict, cut.exit_code) == ("unknown", "unknown", 4)
    assert cut["a"].reason == "the limit of 3 configurations was reached"
    assert cut.faults.verdict == "unknown" and cut.faults.reason is not None


def test_a_name_that_there_is_not(result):
    with pytest.raises(KeyError, match="no property `booth`, only `both`, `served`, `dead`"):
        result["booth"]


@pytest.mark.parametrize("make", [lambda r: r, lambda r: r["both"], lambda r: r.faults])
def test_nothing_that_may_be_unknown_is_true_or_false(result, make):
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(make(result))


def test_an_outcome(result):
    both = result["both"]
    assert (both.kind, both.text, both.engine, both.reason) == ("ltl", "G !(ns@GREEN && ew@GREEN)", "explicit", None)
    assert str(both) == "violated both: G !(ns@GREEN && ew@GREEN)"
    assert both.proofs == () and both.notes == () and both.witness is None
    assert result["served"].trace is None and result["served"].traces == ()
    assert result["dead"].vacuity.findings[0].kind == "antecedent"
    assert any("never true" in text for text in result["dead"].vacuity_texts)


@pytest.mark.slow
def test_proofs_of_other_engines(lights):
    found = lights.check("a: G !(ns@GREEN && ew@GREEN)", "induction")
    assert found["a"].verdict == "holds" and found["a"].proofs[0].shows == "prefixes"
    assert found.faults.proofs[0].shows == "faults"


@pytest.mark.slow
def test_text_is_that_of_the_command_line(result, capsys):
    from llfsm_verify.cli import main

    lines = [word for outcome in result for word in ("-p", f"{outcome.name}: {outcome.text}")]
    assert main(["verify", "models/traffic_lights/faulty.yaml", *lines]) == 1
    printed = capsys.readouterr().out.rstrip("\n").splitlines()
    assert [line for line in str(result).splitlines() if ", engine" not in line] == [
        line for line in printed if ", engine" not in line
    ]


@pytest.mark.slow
def test_json_is_that_of_the_command_line(result):
    value = result.to_dict()
    assert json.loads(result.to_json()) == value
    jsonschema.validate(value, SCHEMAS.load("result")("result"))
    assert [p["verdict"] for p in value["properties"]] == ["violated", "holds", "holds"]


def test_other_reports(result):
    assert result.report("junit").startswith("<?xml")
    assert result.report("text") == str(result)
    with pytest.raises(ValueError, match="no report format `pdf`; there are: text, json, junit, sarif"):
        result.report("pdf")


def test_faults_have_places_and_traces():
    arrangement = lv.build(
        "counting",
        {
            "m": lv.MachineDefinition(
                "M", {"A": lv.StateDefinition(internal="n = n + 1;", transitions=[("n > 2", "A")])}
            )
        },
        whiteboard={"n": {"type": "0..2", "init": 0}},
    )
    faults = arrangement.check().faults
    assert faults.verdict == "violated" and len(faults) == 1
    (fault,) = faults
    assert fault.code == "F001" and fault.message == "value outside its range: n is declared 0..2"
    assert fault.trace.fault == fault.message and fault.trace.values(0)["n"] == 0
    assert (
        fault.message in str(fault)
        and "n = n + 1;" in str(fault)
        and repr(fault) == f"<FaultOutcome {fault.code}: {fault.message}>"
    )


def test_notebooks_show_verdicts_and_traces(result):
    page = result._repr_html_()
    assert page.startswith("<pre") and "</pre>" in page
    assert "violated" in page and "NS_PRIORITY" in page and "color:" in page
    assert "ns@GREEN &amp;&amp; ew@GREEN" in page
