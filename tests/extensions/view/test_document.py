"""The document of a check: it fits its schema, its rows are those of the trace, and no text of it ends the page."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Source
from llfsm_verify.extensions.view import document
from llfsm_verify.extensions.view.document import document_of_file, document_of_result
from llfsm_verify.extensions.view.page import page_html
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.cli.running import FAULTY

SCHEMA = json.loads(files("llfsm_verify.extensions.view").joinpath("view.schema.json").read_text(encoding="utf-8"))
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def checked() -> tuple[Result, Any]:
    arrangement = load_arrangement(FAULTY)
    lines = "both: G !(ns@GREEN && ew@GREEN)\nserved: G F ew@GREEN\n"
    properties = parse_properties([Source("p.ltl", lines)])
    return verify(arrangement, properties, Options()), arrangement


def test_a_check_fits_the_schema_and_shows_its_traces(checked: tuple[Result, Any]) -> None:
    result, arrangement = checked
    document = document_of_result(result, arrangement)
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    assert len(page_html(document).encode()) < 2_000_000
    for item in result.properties:
        (run,) = (run for run in document["runs"] if run["property"] == item.name)
        assert item.trace is not None
        steps = item.trace.steps
        assert run["rows"]["step"] == list(range(len(steps) + 1))
        assert [document["machines"][m]["name"] for m in run["rows"]["turn"][1:]] == [step.machine for step in steps]
        told: list[list[str]] = [[] for _ in run["rows"]["step"]]
        for row, machine, number in run["fired"]:
            of = document["machines"][machine]
            taken = of["transitions"][number]
            names = [of["states"][taken[end]]["name"] for end in ("source", "target")]
            told[row].append(f"{names[0]} -> {names[1]} when {taken['when']}")
        assert told[1:] == [[step.fired] if step.fired else [] for step in steps]


def test_of_a_long_run_the_end_is_shown(checked: tuple[Result, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    result, arrangement = checked
    whole = document_of_result(result, arrangement)["runs"]
    monkeypatch.setattr(document, "MOST_ROWS", 5)
    for run, cut in zip(whole, document_of_result(result, arrangement)["runs"], strict=True):
        total = len(run["rows"]["step"])
        assert cut["window"] == {"first": total - 5, "total": total}
        assert cut["rows"]["step"] == run["rows"]["step"][-5:]
        assert cut["loop"] is None or cut["loop"] == run["loop"] - total + 5


def test_no_text_ends_its_element(checked: tuple[Result, Any]) -> None:
    """Whatever names and texts are: they come back from the page as they were."""
    result, arrangement = checked
    document = document_of_result(result, arrangement)
    wicked = "</script><script>alert(1)</script><!-- \u2028\"'&amp;\udcff"
    document["runs"][0]["title"] = document["verdicts"][0]["text"] = document["title"] = wicked
    document["verdicts"][1]["text"] = "x" * 1_000_000
    html = page_html(document).encode().decode()
    assert "alert(1)</script>" not in html
    found = re.search(r'<script type="application/json" id="view-document">(.*?)</script>', html, re.DOTALL)
    assert found is not None and json.loads(found[1]) == document


DIVIDES = "name: d\ncycle_ms: 10\nmachines: {m: {file: m.yaml}}\nschedule: [m]\n"
FALLS = """\
machine: M
variables: {n: {type: 0..3, init: 3}, k: {type: 0..9, init: 0}}
states:
  - {name: A, internal: "n = n - 1; k = 8 / n;", transitions: [{to: A, when: k == 9}]}
"""


def test_a_step_that_ends_in_a_fault_changes_nothing(tmp_path: Path) -> None:
    """Of a check, and of a recording, which the runtime has made: what is shown is what there was."""
    (tmp_path / "d.yaml").write_text(DIVIDES)
    (tmp_path / "m.yaml").write_text(FALLS)
    model = lv.load(tmp_path / "d.yaml")
    result = model.check()
    (of_check,) = document_of_result(result.wrapped, model.wrapped)["runs"]
    with model.run(rate=0, record=tmp_path / "d.rec") as run:
        run.wait()
    (recorded,) = document_of_file(str(tmp_path / "d.rec"), None)["runs"]
    for shown in (of_check, recorded):
        assert shown["rows"]["step"] == [0, 1, 2, 3]
        n, k = (next(c for c in shown["changes"] if c["values"][0] == first) for first in (3, 0))
        assert (n["at"], n["values"], k["at"], k["values"]) == ([0, 1, 2], [3, 2, 1], [0, 1, 2], [0, 4, 8])
        (mark,) = shown["marks"]
        assert (mark["row"], mark["kind"]) == (3, "fault")
        assert mark["text"] == "F002: division by zero: n is 0" and mark["place"][1:3] == [4, 41]
        assert shown["ran"]["sets"][shown["ran"]["rows"][3]], "the action in which it ends is shown"
