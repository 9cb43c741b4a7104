"""Stages: each second counts once, for the innermost stage that is under way."""

from __future__ import annotations

import pytest

from llfsm_verify import stages
from llfsm_verify.stages import OTHER, following, record, stage


@pytest.fixture
def clock(monkeypatch):
    """A clock that says how often it was asked: each reading is one second later."""
    readings = iter(range(1000))
    monkeypatch.setattr(stages.time, "process_time", lambda: 0.0)
    monkeypatch.setattr(stages.time, "perf_counter", lambda: float(next(readings)))
    monkeypatch.setattr(stages, "_recording", None)


def test_each_second_counts_once(clock):
    @stage("inner")
    def work() -> None:
        pass

    recording = record()
    with stage("outer"):
        work()
        with stage("inner"):
            pass
    recording.now()
    assert {name: wall for name, (_, wall) in recording.spent.items()} == {OTHER: 2.0, "outer": 3.0, "inner": 2.0}


def test_a_stage_that_fails_ends(clock):
    recording = record()
    with pytest.raises(ZeroDivisionError), stage("outer"):
        _ = 1 / 0
    recording.now()
    assert {name: wall for name, (_, wall) in recording.spent.items()} == {OTHER: 2.0, "outer": 1.0}


def test_who_follows_is_told_of_each_stage(clock):
    told, outer = [], []
    with (
        pytest.raises(ZeroDivisionError),
        following(lambda name, begins: outer.append((name, begins))),
        stage("first"),
        following(lambda name, begins: told.append((name, begins))),
        stage("second"),
    ):
        _ = 1 / 0
    with stage("third"):
        pass
    assert told == [("second", True), ("second", False)]
    assert outer == [("first", True), ("first", False)]


def test_nothing_is_measured_unless_asked(clock):
    with stage("outer"):
        pass
    assert stages.time.perf_counter() == 0.0
