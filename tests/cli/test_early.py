"""Verdicts on standard error while a check goes on."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from llfsm_verify.checking.verdict import EarlyVerdict, Verdict
from llfsm_verify.cli.io import verdicts
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from tests.cli.running import FAULTY, llfsm

BOTH = ("-p", "both: G !(ns@GREEN && ew@GREEN)", "-p", "red: G (ns@AMBER -> !ns@RED)")
ROBOT = ("tests/cli/robot/robot.yaml", "tests/cli/robot/robot.ltl")
LINE = re.compile(
    r"(?:(?P<title>\S+): )?after \d+ s: (?P<verdict>holds on fault-free runs|holds   |violated)  (?P<rest>.*)"
)


def said(errors: str) -> list[str]:
    return [f"{found['verdict'].strip()} {found['rest']}" for found in LINE.finditer(errors)]


@pytest.fixture
def at_once(monkeypatch):
    monkeypatch.setattr(verdicts, "PATIENCE", 0)


def test_a_short_check_only_reports():
    done = llfsm("verify", FAULTY, *BOTH)
    assert said(done.stderr) == []


def test_a_verdict_is_said_with_who_decided_it_and_how_many_are_left(at_once):
    done = llfsm("verify", FAULTY, *BOTH)
    assert said(done.stderr) == [
        "holds faults (by explicit; 2 more to decide)",
        "violated both (by explicit; 1 more to decide)",
        "holds red (by explicit; all are decided)",
    ]
    assert done.stdout.startswith("violated  both  G !(ns@GREEN && ew@GREEN)\nholds     red ")


def test_other_formats_are_as_they_were_and_quiet_says_nothing_before(at_once):
    done = llfsm("verify", FAULTY, *BOTH, "--format", "json")
    assert json.loads(done.stdout)["exit_code"] == 1 and len(said(done.stderr)) == 3
    assert said(llfsm("verify", FAULTY, *BOTH, "-q").stderr) == []


def test_check_names_the_arrangement(at_once, tmp_path):
    (tmp_path / "a.yaml").write_text(Path("models/microwave/faulty_R5.yaml").read_text(), encoding="utf-8")
    done = llfsm("check", "models/traffic_lights/arrangement.yaml")
    (line,) = LINE.finditer(done.stderr)
    assert (line["title"], line["rest"].split()[0]) == ("models/traffic_lights/arrangement.yaml", "faults")


@pytest.mark.slow
def test_guard_says_what_stays(at_once):
    """What is violated with chaos everywhere is asked again with it for the guarded machines alone: then it is said."""
    oven = ("models/microwave/faulty_R5.yaml", "-p", "closed: G (door_open -> !motor)")
    done = llfsm("guard", *oven, "--fallback", "motor=false")
    assert [line.split(" (")[0] for line in said(done.stderr)] == ["holds faults", "holds closed"]
    done = llfsm("guard", *oven, "--fallback", "motor=true")
    assert done.returncode == 1
    assert [line.split(" (")[0] for line in said(done.stderr)] == ["holds faults", "violated closed"]


@pytest.mark.slow
def test_a_first_robot_says_what_it_has_found_and_goes_on(at_once):
    """A newcomer's, of which a whole check takes minutes: the first violation falls after 2,000 configurations."""
    done = llfsm("verify", *ROBOT, "--engine", "explicit", "--max-states", "30000")
    fell = ["violated roams (by explicit; 10 more to decide)", "violated far (by explicit; 9 more to decide)"]
    assert done.returncode == 1 and said(done.stderr) == fell
    verdicts = done.stdout.split("\n\n")[0].splitlines()
    assert [line.split()[1] for line in verdicts if line.startswith("violated")] == ["far", "roams"]


def test_what_fell_before_is_said_when_the_patience_ends(monkeypatch, capsys):
    """The clock runs in a thread: it says what is there, and later ones come at once."""
    monkeypatch.setattr(verdicts, "LOOK", 0.001)
    used = [0.0]
    monkeypatch.setattr(verdicts, "_processor_time", lambda: used[0])
    with EarlyVerdicts(["a", "b"]) as early:
        early.add(EarlyVerdict("a", Verdict.VIOLATED, "bmc"))
        assert capsys.readouterr().err == ""
        used[0] = verdicts.PATIENCE
        early._clock.join()
        assert said(capsys.readouterr().err) == ["violated a (by bmc; 2 more to decide)"]
        early.add(EarlyVerdict("a", Verdict.VIOLATED, "pdr"))
        assert capsys.readouterr().err == ""
        early.add(EarlyVerdict("b", Verdict.HOLDS, "pdr"))
        assert said(capsys.readouterr().err) == ["holds on fault-free runs b (by pdr; 1 more to decide)"]
