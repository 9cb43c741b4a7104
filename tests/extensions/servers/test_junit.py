from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from llfsm_verify.extensions.servers.junit import report as result_junit
from tests.report.results import ALL, BAD, EVERY, GOOD, RESUMED, STRICT, result


@pytest.mark.parametrize("name", EVERY)
def test_counts_agree_with_the_cases(name):
    root = ET.fromstring(result_junit(EVERY[name]))
    suite = root.find("testsuite")
    assert root.tag == "testsuites" and suite is not None
    assert int(suite.get("tests")) == len(suite.findall("testcase")) == len(EVERY[name].properties) + 1
    assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
    assert int(suite.get("errors")) == len(suite.findall("testcase/error"))
    for case in suite.findall("testcase"):
        assert case.get("classname") and case.get("name") and float(case.get("time")) == 0


def test_violated_is_a_failure_unknown_an_error_faults_a_case():
    suite = ET.fromstring(result_junit(ALL)).find("testsuite")
    kinds = {case.get("name"): [child.tag for child in case] for case in suite.findall("testcase")}
    assert kinds == {
        "good": ["system-out"],
        "bad": ["failure"],
        "looping": ["failure"],
        "open": ["error"],
        "faults": ["failure"],
    }
    assert "→ B when car" in suite.find("testcase[@name='bad']/failure").text
    assert "F001" in suite.find("testcase[@name='faults']/failure").get("message")


WHOLE = """\
<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="llfsm-verify" tests="5" failures="3" errors="1" time="0.250">
  <testsuite name="lights" tests="5" failures="3" errors="1" time="0.250" skipped="0">
    <testcase classname="lights" name="good" time="0">
      <system-out>holds on fault-free runs: G a</system-out>
    </testcase>
    <testcase classname="lights" name="bad" time="0">
      <failure type="violated" message="bad: violated: G !(x == 3)">initially x = 0, m = A
0 | initially | !(x == 3)
1–7 | m, n | 7 steps without an event | car = false
8 | m | A | → B when car | car = true | x: 0 → 3
9 | m | B | x == 3
violated after step 9, however the run goes on</failure>
    </testcase>
    <testcase classname="lights" name="looping" time="0">
      <failure type="violated" message="looping: violated: F b">initially x = 0
0 | initially | !b
1 | m | A | x: 0 → 1
2 | m | A | x: 1 → 2
3 | (ended)
steps 2 to 3 repeat forever</failure>
    </testcase>
    <testcase classname="lights" name="open" time="0">
      <error type="unknown" message="open: unknown: F b">the time limit of 1 s was reached</error>
    </testcase>
    <testcase classname="lights" name="faults" time="0">
      <failure type="violated" message="1 place where a run ends in a fault; props.ltl:2:1: F001: `x` would become 4, outside 0..3">initially x = 3
0 | initially
1 | m | A | x: 3 → 2
2 | m | A | FAULT
step 2 ends the run in a fault</failure>
    </testcase>
    <system-out>1,234 configurations, 5,678 transitions, complete, 0.25 s, engine explicit</system-out>
  </testsuite>
</testsuites>"""  # noqa: E501


def test_a_whole_document():
    assert result_junit(ALL) == WHOLE


RESUMED_TEXT = (
    "fails --strict: what the checkpoint says was not searched again, so this is not a pass; search without --resume"
)


def test_what_strict_makes_of_passes():
    def said(value, name):
        case = ET.fromstring(result_junit(value)).find(f"testsuite/testcase[@name='{name}']")
        return [(child.tag, child.get("type"), child.get("message"), child.text) for child in case]

    never = "`a` is never true in any run: `G !a` also holds"
    unseen = "unknown to --strict: not checked for vacuity: a limit"
    assert said(STRICT, "empty") == [
        ("failure", "vacuous", f"empty: fails --strict: {never}", f"fails --strict: {never}"),
        ("system-out", None, None, f"holds: G a\nfails --strict: {never}"),
    ]
    assert said(STRICT, "known") == [("system-out", None, None, f"holds: G a\naccepted: {never}")]
    assert said(STRICT, "unseen") == [
        ("error", "unknown", f"unseen: {unseen}", unseen),
        ("system-out", None, None, f"holds: G a\n{unseen}"),
    ]
    assert said(RESUMED, "unseen") == [
        ("failure", "resumed", f"unseen: {RESUMED_TEXT}", f"{RESUMED_TEXT}\n{unseen}"),
        ("system-out", None, None, f"holds (resumed from old.ckpt): G a\n{RESUMED_TEXT}\n{unseen}"),
    ]
    assert said(RESUMED, "faults") == [("failure", "resumed", f"faults: {RESUMED_TEXT}", RESUMED_TEXT)]


def test_control_characters_do_not_break_the_document():
    nasty = replace(BAD, text='G "<&\x00\x1b]]>"')
    message = ET.fromstring(result_junit(result(nasty))).find(".//failure").get("message")
    assert '"<&' in message and "\x00" not in message


def test_what_is_forbidden_is_said_to_be():
    text = result_junit(result(replace(BAD, kind="forbid", text="x == 3"), replace(GOOD, kind="forbid", text="a b")))
    assert "bad: violated: forbid x == 3" in text and "holds: forbid a b" in text
