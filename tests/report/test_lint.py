"""Findings of lint, made by hand: as text, as JSON and as SARIF, each to the letter."""

from __future__ import annotations

import json
from dataclasses import replace

import jsonschema
import pytest

from llfsm_verify.analysis.lint.finding import Finding, LintResult, OpenQuestion, Witness
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.extensions.servers.findings import report as lint_sarif
from llfsm_verify.kripke.labels.sizes import InputNote
from llfsm_verify.report import lint as reports
from llfsm_verify.report.formats import Style
from llfsm_verify.report.lint import MOST_OPEN, lint_text
from llfsm_verify.report.lint import report_json as lint_json
from llfsm_verify.report.schema import load
from tests.cli.running import LIGHTS
from tests.report.results import PATH as TRACE

LOADED = load_arrangement(LIGHTS)
ARRANGEMENT = replace(LOADED, machines=tuple(replace(m, name=n) for m, n in zip(LOADED.machines, "mnk", strict=True)))
SOURCE = Source("a.yaml", "one: é\ntwo: b\n")
ONE, TWO = Span(SOURCE, 5, 6), Span(SOURCE, 12, 13)
LOCAL = Finding(
    "L001", "warning", "this never fires", ONE, ("m", "n"), "local", ("its guard is never true",), "remove it"
)
RUN = Finding(
    "L007", "warning", "this leaves its range", TWO, ("m",), "run",
    witness=Witness((("n", "3"), ("k", "0")), (("go", "true"), ("by", "2")), TRACE),
)  # fmt: skip
RANGES = Finding(
    "L003", "note", "these overlap", TWO, ("m",), "ranges", witness=Witness((("n", "3"),), (("go", "true"),), None)
)
SILENCED = replace(LOCAL, suppressed="so in the paper", proof="reachable", machines=("m",), hint=None)
TEXT = Finding("L011", "warning", "this is löst", TWO, ("m", "n"), "text")
RESULT = LintResult(
    "lights", "a.yaml", (LOCAL, RUN, RANGES, SILENCED, TEXT),
    (
        OpenQuestion("L012", "whether a machine is stuck", TWO),
        OpenQuestion("L001", "whether it fires", ONE, "ask `llfsm query`"),
    ),
    True, False, "the limit was reached", 1234, ("x", "y"),
    (InputNote(("d",), 256, 4), InputNote(("e", "f"), 9, None, "it is multiplied")), 0.123456789,
)  # fmt: skip
EMPTY = LintResult("lights", "a.yaml", (), (), False, True, None, 0, (), (), 1.0)


def said(result: LintResult, **options: bool) -> list[str]:
    return [line.plain for line in lint_text(result, **options) if hasattr(line, "plain")]


FINDINGS = [
    "a.yaml:1:6: warning[L001]: this never fires",
    "    1 | one: é",
    "      |      ^",
    "  note: its guard is never true",
    "  note: in `m`, `n`",
    "  note: proved: no turn does otherwise, from any values inside the declared ranges",
    "  hint: remove it",
    "",
    "a.yaml:2:6: warning[L007]: this leaves its range",
    "    2 | two: b",
    "      |      ^",
    f"  note: in a run of {len(TRACE.steps)} steps; before the last: n = 3, k = 0; sampled: go = true, by = 2",
    "",
    "a.yaml:2:6: note[L003]: these overlap",
    "    2 | two: b",
    "      |      ^",
    "  note: for some values inside the declared ranges; not known to be reachable",
    "  note: before the turn: n = 3; sampled: go = true",
    "",
]
ACCEPTED = [
    "a.yaml:1:6: accepted[L001]: this never fires",
    "    1 | one: é",
    "      |      ^",
    "  note: its guard is never true",
    "  note: proved: no run does otherwise (1,234 configurations)",
    "  note: accepted: so in the paper",
    "",
]
REST = [
    "a.yaml:2:6: warning[L011]: this is löst",
    "    2 | two: b",
    "      |      ^",
    "",
    "a.yaml:2:6: unknown[L012]: whether a machine is stuck",
    "a.yaml:1:6: unknown[L001]: whether it fires",
    "  hint: ask `llfsm query`",
    "",
    "3 warnings, 1 note, 1 accepted, 2 unknown; 1,234 configurations, not complete: the limit was reached, 0.12 s",
    "counted without what nothing depends on: x, y",
    "d: 4 classes of 256 values",
    "e, f: all 9 values, because it is multiplied",
]


def test_findings_as_text() -> None:
    assert said(RESULT) == FINDINGS + REST
    assert said(RESULT, suppressed=True) == FINDINGS + ACCEPTED + REST
    assert said(EMPTY) == ["0 warnings, 0 notes; single turns only, 1.00 s"]
    complete = replace(EMPTY, explored=True, configurations=1, findings=(TEXT,))
    assert said(complete)[-1] == "1 warning, 0 notes; 1 configuration, complete, 1.00 s"


def test_colours_tell_what_a_finding_is() -> None:
    lines = [line for line in lint_text(RESULT, suppressed=True) if line.style]
    coloured = {line.plain.split(": ")[1].split("[")[0]: line.style for line in lines}
    assert coloured == {"warning": "yellow", "note": "cyan", "accepted": "dim", "unknown": "yellow"}


def test_runs_are_shown_when_they_are_asked_for() -> None:
    more = len([*lint_text(RESULT, traces=True)]) - len([*lint_text(RESULT)])
    assert more == len([*reports.run_text(TRACE)]) > 0
    style = Style(traces=True, suppressed=True)
    reported = [*reports.report(RESULT, ARRANGEMENT, style)]
    assert len(reported) == len([*lint_text(RESULT, traces=True, suppressed=True)])


def test_a_run_without_a_step() -> None:
    start = replace(RUN, witness=Witness((), (), replace(TRACE, steps=())))
    assert "  note: from the start" in said(replace(RESULT, findings=(start,)))
    once = replace(RUN, witness=Witness((), (), replace(TRACE, steps=TRACE.steps[:1])))
    assert "  note: in a run of 1 step" in said(replace(RESULT, findings=(once,)))


@pytest.mark.parametrize("more", [0, 1, 7])
def test_of_many_open_questions_the_first_are_listed(more: int) -> None:
    questions = tuple(OpenQuestion("L012", f"question {i}", ONE) for i in range(MOST_OPEN + more))
    lines = said(replace(EMPTY, open=questions))
    assert [line.rpartition(" ")[2] for line in lines[:MOST_OPEN]] == [str(i) for i in range(MOST_OPEN)]
    rest = [f"and {more} more like this (--format json has all)"] if more else []
    assert lines[MOST_OPEN:-1] == [*rest, ""]


def test_findings_as_json() -> None:
    text = lint_json(RESULT)
    assert reports.report_json(RESULT, ARRANGEMENT, Style()) == text
    value = json.loads(text)
    jsonschema.validate(value, load("lint"))
    assert text == json.dumps(value, indent=2, ensure_ascii=False) and "löst" in text
    findings = value.pop("findings")
    one = {"file": "a.yaml", "line": 1, "column": 6, "end_line": 1, "end_column": 7}
    two = {"file": "a.yaml", "line": 2, "column": 6, "end_line": 2, "end_column": 7}
    assert value == {
        "format": value["format"],
        "arrangement": "lights",
        "path": "a.yaml",
        "unknown": [
            {"code": "L012", "message": "whether a machine is stuck", "span": two, "hint": None},
            {"code": "L001", "message": "whether it fires", "span": one, "hint": "ask `llfsm query`"},
        ],
        "explored": True,
        "complete": False,
        "reason": "the limit was reached",
        "states": 1234,
        "left_out": ["x", "y"],
        "inputs": [
            {"inputs": ["d"], "values": 256, "classes": 4, "reason": None},
            {"inputs": ["e", "f"], "values": 9, "classes": None, "reason": "it is multiplied"},
        ],
        "seconds": 0.123457,
        "exit_code": 1,
    }
    assert findings[0] == {
        "code": "L001",
        "level": "warning",
        "message": "this never fires",
        "span": one,
        "machines": ["m", "n"],
        "proof": "local",
        "notes": ["its guard is never true"],
        "hint": "remove it",
        "witness": None,
        "silenced": None,
    }
    shown = findings[1]["witness"]
    assert shown.pop("trace")["steps"]
    assert shown == {"reachable": True, "variables": {"n": "3", "k": "0"}, "inputs": {"go": "true", "by": "2"}}
    assert findings[2]["witness"] == {
        "reachable": False, "variables": {"n": "3"}, "inputs": {"go": "true"}, "trace": None,
    }  # fmt: skip
    assert [f["silenced"] for f in findings] == [None, None, None, "so in the paper", None]


def test_findings_as_sarif() -> None:
    arrangement = replace(ARRANGEMENT, warnings=(Diagnostic("W002", "always true", ONE),))
    text = lint_sarif(RESULT, arrangement)
    (run,) = json.loads(text)["runs"]
    results = run["results"]
    assert [(r["ruleId"], r.get("level"), r.get("kind", "fail")) for r in results] == [
        ("L001", "warning", "fail"),
        ("L007", "warning", "fail"),
        ("L003", "note", "fail"),
        ("L001", "warning", "fail"),
        ("L011", "warning", "fail"),
        ("L012", "none", "open"),
        ("L001", "none", "open"),
        ("W002", "warning", "fail"),
    ]
    assert results[0]["message"]["text"].split("\n") == [
        "this never fires",
        "its guard is never true",
        "in `m`, `n`",
        "proved: no turn does otherwise, from any values inside the declared ranges",
        "Hint: remove it",
    ]
    assert results[6]["message"]["text"] == "whether it fires\nHint: ask `llfsm query`"
    places = [r["locations"][0]["physicalLocation"]["region"]["startLine"] for r in results]
    assert places == [1, 2, 2, 1, 2, 2, 1, 1]
    assert [bool(r.get("codeFlows")) for r in results] == [False, True, *[False] * 6]
    accepted = [{"kind": "inSource", "justification": "so in the paper"}]
    assert [r.get("suppressions") for r in results] == [None, None, None, accepted, None, None, None, None]
    rules = {rule["id"] for rule in run["tool"]["driver"]["rules"]}
    assert rules == {"L001", "L007", "L003", "L011", "L012", "W002"}
    (invocation,) = run["invocations"]
    notes = [n["message"]["text"] for n in invocation["toolExecutionNotifications"]]
    assert notes == ["unknown: whether a machine is stuck", "unknown: whether it fires"]
    assert (invocation["exitCode"], invocation["executionSuccessful"]) == (1, True)
    stands = replace(RUN, witness=Witness((), (), replace(TRACE, steps=())))
    (run,) = json.loads(lint_sarif(replace(RESULT, findings=(stands,)), ARRANGEMENT))["runs"]
    assert not any("codeFlows" in r for r in run["results"])
