from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from llfsm_verify.report.junit import result_junit
from tests.report.results import ALL, BAD, EVERY, GOOD, result


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


def test_control_characters_do_not_break_the_document():
    nasty = replace(BAD, text='G "<&\x00\x1b]]>"')
    message = ET.fromstring(result_junit(result(nasty))).find(".//failure").get("message")
    assert '"<&' in message and "\x00" not in message


def test_what_is_forbidden_is_said_to_be():
    text = result_junit(result(replace(BAD, kind="forbid", text="x == 3"), replace(GOOD, kind="forbid", text="a b")))
    assert "bad: violated: forbid x == 3" in text and "holds: forbid a b" in text
