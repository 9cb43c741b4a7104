"""A saved run that does not give everything, against all runs with constant values tried one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from random import Random

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.verification import replay as replaying
from llfsm_verify.verification.replay import replay
from llfsm_verify.verification.verify import verify

STATES = ("A", "B", "C")


def random_arrangement(random: Random) -> Arrangement:
    """One machine whose guards compare two inputs, each of three values."""

    def guard() -> str:
        parts = [f"{random.choice('ab')} {random.choice(('==', '!=', '<'))} {random.randrange(3)}" for _ in range(2)]
        return random.choice((" && ", " || ")).join(parts[: random.randint(1, 2)])

    states = [
        {"name": name, "transitions": [{"when": guard(), "to": random.choice(STATES)} for _ in range(2)]}
        for name in STATES
    ]
    whiteboard = {name: {"type": "0..2", "init": 0, "role": "input"} for name in "ab"}
    machine = {"machine": "M", "states": states}
    return build_arrangement({"whiteboard": whiteboard, "machines": {"m": {"inline": machine}}, "schedule": ["m"]})


def forgetting(schedule: Schedule, name: str) -> Schedule:
    """The same run without the values of an input."""
    moves = tuple(Move(m.process, {k: v for k, v in m.choices.items() if k != name}) for m in schedule.ringlets)
    return replace(schedule, ringlets=moves)


def one_by_one(arrangement: Arrangement, properties, schedule: Schedule) -> str:
    """What every run with constant values of both inputs, where the schedule gives none, comes to."""
    found = set()
    for values in product(range(3), repeat=2):
        moves = tuple(
            Move(m.process, dict(zip("ab", values, strict=True)) | dict(m.choices)) for m in schedule.ringlets
        )
        found.add(replay(arrangement, properties, replace(schedule, ringlets=moves)).outcome)
    return next(outcome for outcome in ("fails", "misfit", "passes") if outcome in found)


def compare(seeds: range) -> set[str]:
    """Saved runs of random arrangements, shortened by an input, on other random arrangements; the outcomes seen."""
    outcomes = set()
    for seed in seeds:
        random = Random(seed)
        saved, mended = random_arrangement(random), random_arrangement(random)
        properties = parse_properties([Source("p", random.choice(("p: G !m@C", "p: G F m@B", "p: F m@C")))])
        trace = verify(saved, properties, engine="explicit").properties[0].trace
        if trace is None:
            continue
        moves = tuple(Move(0, {s.choice: s.value for s in step.choices}) for step in trace.steps)
        schedule = forgetting(Schedule(trace.initial_free, moves, trace.loop), random.choice("ab"))
        done = replay(mended, properties, schedule, complete=True)
        assert done.outcome == one_by_one(mended, properties, schedule), seed
        assert done.missing is None
        outcomes.add(done.outcome)
    return outcomes


@pytest.mark.slow
def test_completed_runs():
    assert compare(range(6)) == {"fails", "passes"}


@pytest.mark.long
def test_many_completed_runs():
    assert compare(range(100, 140)) >= {"fails", "passes"}


def test_too_many_completions_are_a_misfit(monkeypatch):
    monkeypatch.setattr(replaying, "MAX_COMPLETIONS", 3)
    machine = {"machine": "M", "states": [{"name": "A", "transitions": [{"when": "a == 1", "to": "A"}]}]}
    whiteboard = {"a": {"type": "0..2", "init": 0, "role": "input"}}
    document = {"whiteboard": whiteboard, "machines": {"m": {"inline": machine}}, "schedule": ["m"]}
    properties = parse_properties([Source("p", "p: G m@A")])
    schedule = Schedule((), (Move(0, {}),), None)
    done = replay(build_arrangement(document), properties, schedule, complete=True)
    assert done.outcome == "misfit" and "reads `a`, which the run does not give" in done.reason
    monkeypatch.setattr(replaying, "MAX_COMPLETIONS", 4)
    done = replay(build_arrangement(document), properties, schedule, complete=True)
    assert done.outcome == "passes" and "whatever constant value `a` has" in done.reason


def test_what_was_completed_is_named_in_order():
    machine = {"machine": "M", "states": [{"name": "A", "transitions": [{"when": "e && d || c && b || a", "to": "A"}]}]}
    whiteboard = {name: {"type": "bool", "role": "input"} for name in "edcba"}
    document = {"whiteboard": whiteboard, "machines": {"m": {"inline": machine}}, "schedule": ["m"]}
    first = Schedule((), (Move(0, {}),), None)
    done = replay(build_arrangement(document), parse_properties([Source("p", "p: G m@A")]), first, complete=True)
    names = "`a`, `b`, `c`, `d`, `e`"
    assert done.outcome == "passes"
    assert done.reason.endswith(f", whatever constant value {names} has, which the saved run does not give")
