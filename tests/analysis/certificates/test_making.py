"""What a certificate cannot be made of: a verdict that is not right, or more than the limits allow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify.analysis.certificates import making
from llfsm_verify.analysis.certificates.making import certificate
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.certificate import NOT_CERTIFIED, PROVED, checked
from llfsm_verify.checking.verdict import FaultResult, Verdict
from llfsm_verify.diagnostics import Disagreement, Source
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.analysis.certificates.test_changes import COUNTING, PROCESSES

LINES = "a: G far < 3\nb: F m@B\nc: G F (m@A || m@B)\nd: G far <= 3"


def problem(text: str, lines: str):
    arrangement = load_arrangement_text(text)
    properties = parse_properties([Source("p.ltl", lines)], "llfsm", frozenset({"regular"}))
    return arrangement, properties, verify(arrangement, properties, engine="explicit")


@pytest.mark.parametrize("number", [0, 1])
def test_a_violated_property_is_not_shown_to_hold(number: int, tmp_path: Path) -> None:
    arrangement, properties, result = problem(COUNTING, LINES)
    items = list(result.properties)
    assert items[number].verdict is Verdict.VIOLATED
    items[number] = replace(items[number], verdict=Verdict.HOLDS, trace=None)
    with pytest.raises(Disagreement):
        certificate(arrangement, properties, replace(result, properties=tuple(items)), tmp_path)


@pytest.mark.parametrize("number", [2, 3])
def test_a_property_that_holds_is_not_shown_to_be_violated(number: int, tmp_path: Path) -> None:
    """With the trace of another property."""
    arrangement, properties, result = problem(COUNTING, LINES)
    items = list(result.properties)
    assert items[number].verdict is Verdict.HOLDS
    trace = items[1 if number == 2 else 0].trace
    items[number] = replace(items[number], verdict=Verdict.VIOLATED, trace=trace)
    wrong = replace(result, properties=tuple(items))
    path = tmp_path / "c.json"
    try:
        path.write_text(certificate(arrangement, properties, wrong, tmp_path).text)
    except Disagreement:
        return
    assert checked(path, tmp_path)[1] not in (PROVED, NOT_CERTIFIED)


def test_a_fault_is_proved_and_not_denied(tmp_path: Path) -> None:
    arrangement, properties, result = problem(PROCESSES.replace("n == 2, to", "n == 9, to"), "a: G n <= 2")
    assert result.faults.verdict is Verdict.VIOLATED
    path = tmp_path / "c.json"
    path.write_text(certificate(arrangement, properties, result, tmp_path).text)
    said, code = checked(path, tmp_path)
    assert code == PROVED
    assert "proved  violated  faults  (runs: 1)" in said
    assert any(line.startswith("proved  holds on fault-free runs  a  G n <= 2") for line in said)
    with pytest.raises(Disagreement):
        certificate(arrangement, properties, replace(result, faults=FaultResult(Verdict.HOLDS, ())), tmp_path)


@pytest.mark.parametrize("whole", range(0, 60, 3))
def test_a_limit_may_be_reached_anywhere(whole: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At every tick of this work, one in three: what is there is a certificate all the same."""
    arrangement, properties, result = problem(
        COUNTING, f"{LINES}\nenforce e: (m@A m@B)*\nforbid f: m@A [far == 3 && m@B]"
    )
    ticks = 0

    def tick(_: object) -> None:
        nonlocal ticks
        ticks += 1
        if ticks > whole:
            raise LimitReached("the time limit of 1 s was reached")

    monkeypatch.setattr(Budget, "tick", tick)
    made = certificate(arrangement, properties, result, tmp_path)
    monkeypatch.undo()
    (tmp_path / "c.json").write_text(made.text)
    said, code = checked(tmp_path / "c.json", tmp_path)
    assert code == (NOT_CERTIFIED if made.missing else PROVED), said


def test_what_a_limit_cuts_short_is_not_certified(tmp_path: Path) -> None:
    arrangement, properties, result = problem(COUNTING, LINES)
    made = certificate(arrangement, properties, result, tmp_path, Limits(timeout=0.0))
    assert {name for name, _ in made.missing} == {"b", "c", "d", "faults"}
    assert all("time limit" in reason for _, reason in made.missing)
    path = tmp_path / "c.json"
    path.write_text(made.text)
    said, code = checked(path, tmp_path)
    assert code == NOT_CERTIFIED
    assert any(line.startswith("not certified  holds  faults: the time limit") for line in said)
    assert any(line.startswith("proved  violated  a") for line in said)


def test_goals_that_a_limit_cuts_short_are_each_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def cut(*_: object) -> None:
        raise LimitReached("the time limit of 1 s was reached")

    arrangement, properties, result = problem(COUNTING, LINES)
    monkeypatch.setattr(making, "goals_of", cut)
    made = certificate(arrangement, properties, result, tmp_path)
    assert {"c", "d"} <= {name for name, _ in made.missing} <= set("abcd")
    assert all("time limit" in reason for _, reason in made.missing)


def test_an_interrupt_is_passed_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_explorer: object) -> None:
        raise KeyboardInterrupt

    arrangement, properties, result = problem(COUNTING, LINES)
    monkeypatch.setattr("llfsm_verify.analysis.certificates.making.explore", interrupted)
    with pytest.raises(KeyboardInterrupt):
        certificate(arrangement, properties, result, tmp_path)
