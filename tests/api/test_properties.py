"""What a check is asked: a text, files, lines, or a mapping."""

from __future__ import annotations

from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.api.properties import read_properties

FILE = "properties/traffic_lights_rules.ltl"


def names(properties: object) -> list[str]:
    return [f"{p.kind} {p.name}" for p in read_properties(properties)]  # type: ignore[arg-type]


def test_the_ways_to_ask():
    text = "assume fair: G F car\nboth: G !(ns@GREEN && ew@GREEN)\nforbid never: [ns@AMBER && ew@AMBER]\n"
    lines = ["assume fair: G F car", "both: G !(ns@GREEN && ew@GREEN)", "forbid never: [ns@AMBER && ew@AMBER]"]
    by_name = {
        "assume fair": "G F car",
        "both": "G !(ns@GREEN && ew@GREEN)",
        "forbid never": "[ns@AMBER && ew@AMBER]",
    }
    assert names(text) == names(lines) == names(tuple(lines)) == names(by_name)
    assert names(text) == ["assume fair", "ltl both", "forbid never"]


def test_files():
    found = names(Path(FILE))
    assert found == names(FILE) == names([FILE]) == names([Path(FILE)]) and len(found) == 5
    assert names([FILE, "a: G p", "G q", "G r"]) == [*found, "ltl a", "ltl L2", "ltl L3"]
    assert names([]) == names(()) == names("") == names({}) == []


def test_a_file_that_is_missing(tmp_path):
    for path in (tmp_path / "no.ltl", str(tmp_path / "no.ltl"), [tmp_path / "no"]):
        with pytest.raises(lv.DiagnosticError, match="E301"):
            read_properties(path)


@pytest.mark.parametrize("wrong", [3, None, b"G p", [3], {"a": 3}, [None]])
def test_something_else(wrong):
    with pytest.raises(TypeError, match=r"propert(ies are|y is) a text"):
        read_properties(wrong)


def test_mistakes_show_the_place(lights):
    with pytest.raises(lv.DiagnosticError) as caught:
        lights.check(["good: G car", "bad: G !(ns@GREN && ew@GREEN)"])
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "E112" and diagnostic.hint == "did you mean `GREEN`?"
    assert diagnostic.span is not None and diagnostic.span.text == "GREN"
    assert "<properties>:2:13" in str(caught.value)


def test_another_syntax():
    (found,) = read_properties(["a: [] !p"], "spin")
    assert found.syntax == "spin" and found.text == "[] !p"


def test_a_syntax_that_there_is_not(lights):
    for ask in (lights.check, lights.query, lights.monitor, lights.lint, lights.explore):
        with pytest.raises(ValueError, match="there is no syntax `promela`; there are: llfsm, spot, spin, nusmv"):
            ask("G p", syntax="promela")
