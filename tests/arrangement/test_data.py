"""Arrangements from Python data: the same model and mistakes as from a file, at places in the data."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest
import yaml

from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.report.json import diagnostic_object, span_object
from llfsm_verify.yaml.nodes import MAX_DEPTH
from tests.bad_input.cases import CASES

STATES = [
    {"name": "GREEN", "on_entry": "n = 1;\nn = none;", "transitions": [{"when": "true", "to": "GREEN"}]},
    {"name": "AMBER", "transitions": [{"when": "car", "to": "GREEN"}, {"when": "n == 1 && far", "to": "GREEN"}]},
]


def document(states: list[object], **more: object) -> dict[str, object]:
    board = {"car": {"type": "bool"}, "n": {"type": "0..3"}}
    machines = {"m": {"inline": {"machine": "M", "states": states}}}
    return {"whiteboard": board, "machines": machines, "schedule": ["m"], **more}


def mistakes(data: object) -> list[Diagnostic]:
    with pytest.raises(DiagnosticError) as caught:
        build_arrangement(data)  # type: ignore[arg-type]
    return list(caught.value.diagnostics)


def test_a_wrong_expression_is_shown_with_its_column_at_its_place() -> None:
    first, second = mistakes(document([*STATES]))
    assert first.render().split("\n")[:3] == [
        "machines.m.inline.states[0].on_entry:2:5: error[E110]: there is no variable `none` here",
        "    2 | n = none;",
        "      |     ^^^^",
    ]
    assert second.render().split("\n")[:3] == [
        "machines.m.inline.states[1].transitions[1].when:1:11: error[E110]: there is no variable `far` here",
        "    1 | n == 1 && far",
        "      |           ^^^",
    ]


def test_json_names_the_place_too() -> None:
    first, _ = mistakes(document([*STATES]))
    (compound,) = mistakes(document([{"on_exit": ""}]))
    assert first.span is not None and compound.span is not None
    inline = "machines.m.inline.states[0]"
    assert span_object(first.span) == {
        "file": f"{inline}.on_entry", "line": 2, "column": 5, "end_line": 2, "end_column": 9,
    }  # fmt: skip
    assert span_object(compound.span) == {"file": inline, "line": 1, "column": 1, "end_line": 1, "end_column": 1}
    assert diagnostic_object(first)["file"] == f"{inline}.on_entry"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({}, "<document>: error[E034]: an arrangement has no `machines`"),
        ([], "<document>: error[E030]: an arrangement must be a mapping (`key: value`)"),
        (document([]), "machines.m.inline.states: error[E074]: a machine needs at least one state"),
        (document([{"on_exit": ""}]), "machines.m.inline.states[0]: error[E034]: a state has no `name`"),
        (document([{"name": "A", "internal": [1]}]),
         "machines.m.inline.states[0].internal: error[E032]: `internal` must be a single value"),
        (document([{"name": "A"}], format=2),
         "format:1:1: error[E097]: the arrangement is of format 2, but this version of llfsm-verify knows only 1"),
        (document([{"name": "A"}], finished=None), "finished: error[E032]: `finished` must be a single value"),
        (document([{"name": "A"}], types={"a b": "bool"}),
         "types['a b']:1:1: error[E036]: `a b` cannot be the name of a type"),
        (document([{"name": "A"}], types={1: "bool", "1": "bool"}),
         "types.1:1:1: error[E017]: the key `1` appears twice"),
        (document([{"name": "A"}], types={"\ud800": "bool"}),
         "types['\\ud800']:1:1: error[E005]: half of a surrogate pair is not a character"),
    ],
)  # fmt: skip
def test_places(data: object, said: str) -> None:
    assert said in [d.render().split("\n")[0] for d in mistakes(data)]


def test_a_note_names_the_other_place() -> None:
    (found,) = mistakes(document([{"name": "A"}, {"name": "A"}]))
    assert str(found.span) == "machines.m.inline.states[1].name:1:1"
    assert found.notes == ("the first one is at machines.m.inline.states[0].name",)


def test_data_without_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    ring: dict[str, object] = {}
    ring["machines"] = ring
    (deep,) = mistakes(ring)
    assert deep.code == "E012" and str(deep.span) == ".".join(["machines"] * MAX_DEPTH)
    lists: list[object] = []
    for _ in range(2 * MAX_DEPTH):
        lists = [lists]
    (deep,) = mistakes({"schedule": lists})
    assert deep.code == "E012" and str(deep.span) == "schedule" + "[0]" * (MAX_DEPTH - 1)
    monkeypatch.setattr("llfsm_verify.yaml.nodes.MAX_NODES", 100)
    (wide,) = mistakes({"name": [0] * 100})
    assert (wide.code, str(wide.span)) == ("E013", "name[98]")


KEYS = [c for c in CASES if c.code >= "E030" and "&" not in c.text and "*" not in c.text and len(c.text) < 2000]


@pytest.mark.parametrize("text", [c.text.replace("§", "") for c in KEYS], ids=[c.reason for c in KEYS])
def test_mistakes_are_those_of_the_file(text: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        load_arrangement_text(text)
    said = [(d.code, d.message, d.hint) for d in caught.value.diagnostics]
    assert [(d.code, d.message, d.hint) for d in mistakes(yaml.load(text, Loader=yaml.BaseLoader))] == said


@pytest.mark.parametrize("path", sorted(Path("models").glob("*/arrangement.yaml")), ids=lambda path: path.parent.name)
def test_a_model_is_the_same(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    text = Path(path.name).read_text(encoding="utf-8")
    read, built = load_arrangement_text(text), build_arrangement(yaml.load(text, Loader=yaml.BaseLoader))
    assert built.path == "<document>" and built.digest != read.digest
    assert without_places(built.machines) == without_places(read.machines)
    assert without_places(built.whiteboard) == without_places(read.whiteboard)
    assert without_places(built.processes) == without_places(read.processes)
    assert (built.profile, built.cycle_ms, built.types) == (read.profile, read.cycle_ms, read.types)


def without_places(part: object) -> str:
    return re.sub(r"span=Span\(\w+=\d+, \w+=\d+\)", "", repr(part))


def test_the_digest_tells_data_apart() -> None:
    states = [{"name": "A", "on_entry": "n = 1;"}]
    found = build_arrangement(document(states)).digest
    assert found == build_arrangement(document([{"name": "A", "on_entry": "n = 1;"}])).digest
    others = [document([{"name": "A", "on_entry": "n = 2;"}]), document([{"name": "A", "on_exit": "n = 1;"}])]
    assert len({found, *(build_arrangement(other).digest for other in others)}) == 3


@pytest.mark.slow
def test_findings_of_lint_are_accepted_where_the_data_says_so() -> None:
    never = {"when": "n == 3", "to": "A"}
    accepted = {**never, "lint": {"L001": "later"}}
    result = lint(build_arrangement(document([{"name": "A", "transitions": [never, accepted]}])))
    places = {(f.code, str(f.span), f.suppressed) for f in result.findings}
    there = "machines.m.inline.states[0].transitions"
    assert {("L001", f"{there}[0].when:1:1", None), ("L001", f"{there}[1].when:1:1", "later")} <= places


@pytest.mark.slow
def test_no_yaml_is_needed() -> None:
    code = """
        import sys
        sys.modules["yaml"] = None
        from llfsm_verify.arrangement import build_arrangement
        machine = {"machine": "M", "states": [{"name": "A"}]}
        print(build_arrangement({"machines": {"m": {"inline": machine}}, "schedule": ["m"]}).name)
    """
    done = subprocess.run([sys.executable, "-c", dedent(code)], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("arrangement\n", "")
