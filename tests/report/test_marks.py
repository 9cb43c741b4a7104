"""Causes, reasons, empty passes and further traces in every format."""

from __future__ import annotations

import io
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

from rich.console import Console

from llfsm_verify.checking.trace import Cause, Trace
from llfsm_verify.checking.verdict import VacuityFinding
from llfsm_verify.extensions.servers.junit import report as result_junit
from llfsm_verify.report.json import result_json
from llfsm_verify.report.text import result_text
from llfsm_verify.report.tracetable import rows
from llfsm_verify.report.wording import because_text, loop_text
from tests.report.results import EMPTY, ESCAPED, ESCAPING, KNOWN, LEFT, MARKED, PATH, STRICT, result, step


def printed(value, *, colour: bool = False, **options) -> str:
    console = Console(file=io.StringIO(), width=200, force_terminal=colour, highlight=False, markup=False)
    for item in result_text(value, **options):
        console.print(item, soft_wrap=True)
    return console.file.getvalue()


def test_marks_stand_before_the_atoms_also_where_these_do_not_change():
    assert [row.atoms for row in rows(MARKED)] == ["!(x == 3)", "", "", "•x == 3"]
    cause = (Cause("x == 3", False),)
    first = replace(PATH, initial_causes=cause, steps=(replace(PATH.steps[0], causes=cause), *PATH.steps[1:]))
    assert [row.atoms for row in rows(first)][:2] == ["•!(x == 3)", "•!(x == 3)"]


def test_quiet_steps_with_the_same_causes_fold_and_show_them():
    quiet = step(atoms=(("b", False),))
    marked = replace(quiet, causes=(Cause("b", False),))
    trace = Trace((), (), (("b", False),), (*[quiet] * 5, *[marked] * 5), None)
    assert [(row.step, row.atoms) for row in rows(trace)] == [("0", "!b"), ("1–5", ""), ("6–10", "•!b")]


def test_steps_inside_an_observed_cycle_have_no_causes_that_keep_them_apart():
    inside = replace(step(atoms=()), observed=False)
    ends = step(atoms=(("b", False),))
    marked = replace(ends, causes=(Cause("b", False),))
    trace = Trace((), (), (("b", False),), (*(inside, ends) * 2, *(inside, marked) * 3), None)
    assert [(row.step, row.atoms) for row in rows(trace)] == [("0", "!b"), ("1–5", ""), ("6–10", "•!b")]


def test_atoms_that_other_columns_show_are_shown_when_they_cause_the_failure():
    ran = step(atoms=(("m.ran", True),))
    trace = Trace((), (), (("m.ran", False),), (replace(ran, causes=(Cause("m.ran", True),)),), None)
    assert [row.atoms for row in rows(trace)] == ["", "•m.ran"]


def test_the_last_line_says_why():
    assert because_text(MARKED) == "it fails because `x == 3` is true at step 9" and because_text(PATH) is None
    assert "It fails because `x == 3` is true at step 9." in printed(STRICT)


def test_marks_are_red_on_a_terminal_and_plain_without_colours():
    assert "•x == 3" in printed(STRICT)
    assert "\x1b[1;31m•x == 3" in printed(STRICT, colour=True)


def test_other_counterexamples_follow_and_it_is_said_when_there_are_no_more():
    text = printed(STRICT)
    assert "twice is violated on another path (2 of 2):" in text
    assert "No more than 2 counterexamples are shown: there is no third." in text


def test_a_witness_is_shown_by_a_step():
    assert loop_text(replace(PATH, witness=True)) == "shown by step 9, however the run goes on"
    assert loop_text(Trace((), (), (), (), None, witness=True)) == "already shown in the initial configuration"
    assert "shown holds, for example in this run: G a" in printed(STRICT)


def test_findings_stand_below_the_verdict():
    lines = printed(STRICT, quiet=True).splitlines()
    below = {a.split()[1]: b.strip() for a, b in pairwise(lines) if a.startswith("holds")}
    assert below["empty"] == "fails --strict: `a` is never true in any run: `G !a` also holds"
    assert below["known"] == "accepted: `a` is never true in any run: `G !a` also holds"
    assert below["unseen"] == "unknown to --strict: not checked for vacuity: a limit"
    assert "note: `a` is never true" in printed(replace(STRICT, strict=False))


def test_a_run_that_escapes_is_shown_once():
    text = printed(ESCAPED)
    last = "The last chance is lost in step 9: no run goes on from there and meets the assumptions."
    assert text.count("A run in which the arrangement escapes the assumptions (fair):") == text.count(last) == 1
    assert text.count("fails --strict: after step 9 of a run") == 2 and last not in printed(ESCAPED, quiet=True)
    at_once = Trace((), (), (), (), None, escape=True)
    assert loop_text(at_once) == "no run goes on from the initial configuration and meets the assumptions"


def test_that_runs_escape_is_said_beside_verdicts_alone():
    remark = VacuityFinding("subformula", "`a` may be anything", "a")
    found = [replace(item, vacuity=replace(item.vacuity, findings=(LEFT, remark))) for item in ESCAPING]
    asked_nothing = replace(ESCAPED, properties=tuple(found), strict=False, asked_vacuity=False)
    lines = printed(asked_nothing, quiet=True).splitlines()
    assert [line.strip() for line in lines if "note:" in line] == [f"note: {LEFT.message}"] * len(found)


def test_a_run_that_escapes_is_in_all_reports():
    value = json.loads(result_json(ESCAPED))
    assert len(value["escape"]["steps"]) == 9 and value["escape"]["loop"] is None and value["exit_code"] == 1
    suite = ET.fromstring(result_junit(ESCAPED)).find("testsuite")
    assert "the last chance is lost in step 9" in suite.find("testcase[@name='two']/failure").text
    assert [ESCAPED.escape_of(item) is not None for item in ESCAPED.properties] == [True, True, False]


def test_strict_decides_the_exit_code():
    assert STRICT.exit_code == 1 and replace(STRICT, properties=STRICT.properties[:1]).exit_code == 1
    assert replace(STRICT, properties=STRICT.properties[1:4]).exit_code == 4
    assert replace(result(KNOWN), strict=True).exit_code == 0 == result(EMPTY).exit_code


def test_json_has_all_of_it():
    value = json.loads(result_json(STRICT))
    empty, known, unseen, shown, twice = value["properties"]
    assert value["strict"] and [p["vacuity"]["fails"] for p in value["properties"][:3]] == [True, False, False]
    assert empty["vacuity"]["findings"][0]["witness"] == "G !a" and empty["vacuity"]["never"] == ["a"]
    assert known["vacuity"]["accepted"] and unseen["vacuity"]["looked"] == "no"
    assert shown["witness"]["because"] is None and len(twice["more"]) == 1 and twice["only"] == "there is no third"
    assert twice["trace"]["because"] == "`x == 3` is true at step 9"
    assert twice["trace"]["steps"][-1]["causes"] == [{"atom": "x == 3", "value": True, "variables": {"x": "3"}}]


def test_junit_counts_empty_passes_as_failures():
    suite = ET.fromstring(result_junit(STRICT)).find("testsuite")
    kinds = {case.get("name"): [child.tag for child in case] for case in suite.findall("testcase")}
    assert kinds["empty"] == ["failure", "system-out"] and kinds["unseen"] == ["error", "system-out"]
    assert kinds["known"] == ["system-out"]
    assert "never true" in suite.find("testcase[@name='empty']/failure").get("message")
    assert suite.find("testcase[@name='twice']/failure").text.count("it fails because") == 2
