"""Each seeded fault of the case studies is found and shrunk to a minimal run; other searches say what is minimal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.replay.confirm import first_letter
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.testing import ArrangementStateMachine, RunFailed, Subject
from llfsm_verify.verification.verify import verify
from tests.models.cases import CASES
from tests.quick import share


@dataclass(frozen=True, slots=True)
class Minimal:
    """What a violation is shrunk to: `steps`, with `changes` of inputs. `shortest`: with more changes there is a run of
    so many steps (None: of no fewer)."""

    model: str
    version: str
    name: str
    steps: int
    changes: int
    shortest: int | None = None

    @property
    def subject(self) -> Subject:
        arrangement = load_arrangement(Path("models", self.model, f"{self.version}.yaml"))
        lines = parse_properties([read_source(f"properties/{self.model}.ltl")])
        return Subject(arrangement, PropertySet(tuple(p for p in lines.goals if p.name == self.name)))


FOUND = (
    Minimal("traffic_lights", "faulty", "mutual_exclusion", 65, 1),
    Minimal("microwave", "faulty_R1", "R1_one_press_one_minute", 16, 1),
    Minimal("microwave", "faulty_R2", "R2_extra_minute", 24, 3),
    Minimal("microwave", "faulty_R3", "R3_no_effect", 8, 2),
    Minimal("microwave", "faulty_R4", "R4_door", 8, 1),
    Minimal("microwave", "faulty_R5", "R5_stops_cooking", 20, 2),
    Minimal("microwave", "faulty_R5_timer", "R5_keeps_the_time", 12, 2),
    Minimal("microwave", "faulty_R6", "R6_light_off", 12, 2),
    Minimal("microwave", "faulty_R7", "R7_no_early_beep", 20, 2),
    Minimal("ball_conditions", "faulty_vision", "whole_blobs", 4, 2),
    Minimal("ball_conditions", "faulty_BC2", "BC2", 5, 2),
    Minimal("ball_conditions", "faulty_ratio", "BC1", 5, 3),
    Minimal("colour_follower", "faulty_start", "knows_width", 40, 0),
    Minimal("colour_follower", "faulty_sign", "steers_right", 49, 2),
    Minimal("distance_sensor", "faulty_order", "sees_slow", 1, 1),
    Minimal("distance_sensor", "faulty_brake", "stops", 17, 1),
    Minimal("fruit_picking", "faulty_pause", "paused_still", 20, 3),
    Minimal("fruit_picking", "faulty_recovery", "full_hand", 52, 6),
    Minimal("fruit_picking", "faulty_inside", "paused_still", 36, 4),
    # A turtle that is put elsewhere is at the wall sooner.
    Minimal("turtle", "faulty_hasty", "never_hits", 24, 0, shortest=6),
    Minimal("xray", "faulty_edit", "as_shown", 60, 2),
    Minimal("xray", "faulty_door", "door_stops", 40, 2),
    Minimal("xray", "faulty_counter", "no_underdose", 84, 3),
    # What a plant chooses counts as an input.
    Minimal("level_crossing", "faulty_late", "safe", 18, 1),
    Minimal("level_crossing", "faulty_timer", "safe", 48, 1),
    Minimal("lift", "faulty_brake", "in_shaft", 13, 1),
    Minimal("takeover", "faulty_one_sided", "caught", 6, 2),
    Minimal("komodo_region", "faulty_unguarded", "region", 29, 0, shortest=21),
    Minimal("komodo_region", "faulty_order", "region", 43, 3, shortest=31),
    Minimal("komodo_region", "faulty_edge", "region", 28, 2),
    Minimal("komodo_arm", "faulty_hasty", "fast", 5, 1),
    Minimal("komodo_arm", "faulty_backwards", "steady", 6, 1),
    Minimal("komodo_arm", "faulty_one_monitor", "slow", 28, 2, shortest=24),
    Minimal("vacuum", "faulty_reserve", "never_empty", 150, 1),
    Minimal("vacuum", "faulty_lanes", "from_none", 180, 1),
    Minimal("vacuum", "faulty_count", "counts", 25, 1),
    Minimal("vacuum", "faulty_brush", "brush_on", 20, 2),
    Minimal("vacuum", "faulty_order", "lifted_stops", 30, 2),
    Minimal("takeover", "faulty_right", "never_again", 110, 2),
    # What operators do counts as inputs.
    Minimal("batman", "faulty_order", "steps_right", 10, 2),
    Minimal("batman", "faulty_stale", "dead_avoid", 15, 2),
    Minimal("batman", "faulty_inhibit", "inhibited", 15, 3),
    Minimal("batman", "faulty_guard", "guarded", 5, 2),
    Minimal("batman", "faulty_schedule", "stops", 10, 2),
    Minimal("batman", "faulty_patience", "dead_halt", 15, 2),
    Minimal("batman", "faulty_bypass", "stops", 5, 2),
    Minimal("robocup", "faulty_silence", "penalty", 35, 4),
    Minimal("robocup", "faulty_late", "stands_PENALISED", 28, 3),
    Minimal("robocup", "faulty_back", "follows_READY", 18, 5),
    Minimal("robocup", "faulty_pardon", "punished", 8, 2),
    Minimal("robocup", "faulty_button", "once", 7, 1),
    Minimal("press", "faulty_tied", "operator", 9, 2),
    Minimal("press", "faulty_start", "operator", 9, 2),
    Minimal("press", "faulty_clock", "together", 17, 2),
    Minimal("press", "faulty_curtain", "held", 8, 1),
    Minimal("press", "faulty_repeat", "single", 34, 0, shortest=22),
    Minimal("press", "faulty_brake", "operator", 11, 1),
    Minimal("line_follower", "faulty_side", "kept", 5, 1),
    Minimal("line_follower", "faulty_memory", "kept", 15, 1),
    Minimal("line_follower", "faulty_fast", "kept", 6, 1),
    Minimal("line_follower", "faulty_search", "found_right", 24, 1),
    Minimal("reasoned_lights", "faulty_hasty", "mutual_exclusion", 5, 2),
)
UNTESTED = {
    ("fruit_picking", "faulty_reach"): "no finite run violates anything: the robot never comes to its end",
    ("turtle", "faulty_dithering"): "the same: it dithers forever",
    ("lift", "faulty_hurry"): "the same: it opens its door at one floor again and again",
    ("lift", "faulty_favourite"): "the same: it goes up again and again",
}
"""Faulty versions all of whose violations are infinite runs."""

PHASES = [phase for phase in Phase if phase is not Phase.explain]
SETTINGS = settings(
    max_examples=400, stateful_step_count=25, phases=PHASES, derandomize=True, deadline=None, database=None,
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


SEEDS = 12
"""Most seeds that are tried: what Hypothesis finds, and shrinks to, depends on where it begins."""


def shrunk(case, number):
    """With the run that Hypothesis shows, from the seed `number`; None: it finds no violation."""

    @seed(number)
    class Test(ArrangementStateMachine):
        traces = None
        _subject = case.subject

    try:
        run_state_machine_as_test(Test, settings=SETTINGS)
    except RunFailed as failed:
        return failed
    return None


def shortest_by_the_checker(case):
    subject = case.subject
    (result,) = verify(subject.arrangement, subject.properties, engine="explicit").properties
    assert result.trace is not None and result.trace.loop is None
    return len(result.trace.steps)


TRIED = [case for number, case in enumerate(FOUND, 1) if share(number, 3)]
"""All in `make soak`, else every third one."""


@pytest.mark.long
@pytest.mark.parametrize("case", TRIED, ids=[f"{c.model}-{c.version}" for c in TRIED])
def test_every_seeded_fault_is_found_and_shrunk(case):
    found = set()
    for number in range(SEEDS):
        if (failed := shrunk(case, number)) is not None:
            assert case.name in failed.failure.names
            found.add((failed.run.steps, failed.run.changes))
        if (case.steps, case.changes) in found:
            break
    assert (case.steps, case.changes) in found
    assert shortest_by_the_checker(case) == (case.shortest or case.steps)


def fewest_changes(case, most) -> Iterator[tuple[int, int]]:
    """Pairs of steps and changes of violating runs with at most `most` changes: for each number of steps at which there
    are fewer changes than at any before. By breadth first over configurations, states of the monitor and held inputs,
    with the steps of the executor and the edges of the monitor, and nothing of `llfsm_verify.testing.run`."""
    subject = case.subject
    execution, monitor = subject.execution, subject.monitors[case.name]
    program = subject.program
    stimuli = list(subject.stimuli.values())
    schedule = type("Schedule", (), {"free": ()})
    begin = execution.start()
    state = monitor.step(0, monitor.letter(first_letter(execution, schedule)))
    held = tuple(k.start for k in stimuli)
    level = {(begin, state, held): 0}
    best: dict[tuple[bytes, int, tuple[int, ...]], int] = dict(level)
    outputs = {a.name: a.output for a in program.atoms}
    memo: dict[tuple[bytes, int, tuple[int, ...]], tuple[bytes, int]] = {}
    least, steps = most + 1, 0
    while level and least:
        steps += 1
        following: dict[tuple[bytes, int, tuple[int, ...]], int] = {}
        for (record, state, held), changes in level.items():
            for inputs in product(*(range(k.type.low, k.type.high + 1) for k in stimuli)):
                cost = changes + sum(a != b for a, b in zip(held, inputs, strict=True))
                if cost > most or cost >= least:
                    continue
                key = (record, state, inputs)
                if key not in memo:
                    choices = {c: v for k, v in zip(stimuli, inputs, strict=True) for c in (k.name, *k.choices)}
                    result = execution.native.step(record, 0, choices)
                    assert result.status == 0
                    values = execution.layout.decode_outputs(result.record)
                    observed = program.observe == "ringlet" or values[program.cycle]
                    letter = monitor.letter([a for a, output in outputs.items() if values[output]])
                    memo[key] = result.record, monitor.step(state, letter) if observed else state
                after = (*memo[key], inputs)
                if monitor.verdicts[after[1]] is MonitorVerdict.FALSE:
                    least = cost
                    yield steps, cost
                elif cost < best.get(after, most + 1):
                    best[after] = cost
                    following[after] = min(cost, following.get(after, cost))
        level = following


CHECKED = [c for c in FOUND if c.model in ("traffic_lights", "microwave")]


@pytest.mark.slow
@pytest.mark.parametrize("case", CHECKED, ids=[f"{c.model}-{c.version}" for c in CHECKED])
def test_no_run_with_as_few_changes_is_shorter_and_none_as_short_has_fewer(case):
    """By a search of its own."""
    front = list(fewest_changes(case, case.changes))
    assert (case.steps, case.changes) in front
    assert not [one for one in front if one[0] < case.steps]


def test_every_faulty_version_is_tested_or_said_to_be_untestable():
    known = {(c.model, c.version) for c in FOUND} | set(UNTESTED)
    seeded = {(case.model, version) for case in CASES for version in case.violated} | {("traffic_lights", "faulty")}
    assert seeded == known


@pytest.mark.parametrize(("model", "version"), UNTESTED)
def test_violations_by_infinite_runs_alone_are_said_to_be_untested(model, version):
    (case,) = (c for c in CASES if c.model == model)
    subject = Subject(
        load_arrangement(Path("models", model, f"{version}.yaml")),
        PropertySet(tuple(p for p in parse_properties([read_source(case.property_file)]).goals)),
    )
    partly = {u.line.name for u in subject.untested}
    assert case.violated[version] <= partly
