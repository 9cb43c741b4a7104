"""Inputs and sequences of them: values around the constants of guards, few changes, shrinking towards none."""

from __future__ import annotations

from collections import Counter
from decimal import Decimal
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, find, given, settings

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing import Subject, input_sequences, inputs, load, runs
from llfsm_verify.testing.tested import boundaries, longest_wait
from tests.quick import examples

FEW = settings(max_examples=examples(60), database=None, suppress_health_check=list(HealthCheck))


def sensor(*guards, internal="far = distance;", **more):
    """One machine that compares a wide input, and what it has copied of it, with constants."""
    whiteboard = {
        "distance": {"type": "int16", "init": "500", "role": "input", **more},
        "far": {"type": "int16"},
        "mode": {"type": "Mode", "role": "input", "init": "SLOW"},
    }
    states = [
        {"name": "S", "internal": internal, "transitions": [{"when": g, "to": "T"} for g in guards]},
        {"name": "T", "transitions": [{"when": "mode == FAST", "to": "S"}]},
    ]
    return build_arrangement({
        "name": "sensor", "types": {"Mode": ["STOP", "SLOW", "FAST"]}, "whiteboard": whiteboard,
        "machines": {"m": {"inline": {"machine": "M", "states": states}}}, "schedule": ["m"],
    })  # fmt: skip


def test_boundaries_are_constants_of_comparisons_their_neighbours_and_the_ends():
    found = boundaries(lower(sensor("distance == 1234", "distance > 7000")))
    ends = {-32768, 32767}
    assert set(found["distance"]) == {1233, 1234, 1235, 6999, 7000, 7001} | ends
    assert found["mode"] == (0, 1, 2)


def test_boundaries_follow_copies_of_an_input():
    assert {-8, -7, -6} <= set(boundaries(lower(sensor("far < -7")))["distance"])


def test_boundaries_of_inputs_that_keep_their_value():
    stored = sensor("distance == 77", changes="cycle")
    assert {76, 77, 78} <= set(boundaries(lower(stored))["distance"])


def test_atoms_of_properties_are_boundaries_too():
    subject = load(sensor("true"), "far: G (distance < 4321)")
    assert {4320, 4321, 4322} <= set(subject.stimuli["distance"].boundaries)


def test_stretches_are_as_long_as_clocks_and_counters_ask():
    assert longest_wait(load("models/traffic_lights/arrangement.yaml").program) == 20  # 8 s
    assert longest_wait(load("models/microwave/arrangement.yaml").program) == 181  # 180 s on the timer


def test_inputs_shrink_towards_init():
    simplest = find(inputs(sensor("true")), lambda _: True, settings=FEW)
    assert simplest == {"distance": 500, "mode": "SLOW"}
    assert find(inputs(sensor("distance > 7000")), lambda i: i["distance"] > 7000, settings=FEW)["distance"] == 7001


SPEED = {"decimal": "0.1", "range": "-99.0..99.0"}


@pytest.mark.slow
def test_decimals_are_drawn_as_decimals():
    subject = Subject(sensor("distance > 7.25", type=SPEED, init="0.5", internal=""))
    assert {Decimal("7.1"), Decimal("7.2"), Decimal("7.3")} <= set(subject.stimuli["distance"].likely)
    assert find(inputs(subject), lambda _: True, settings=FEW)["distance"] == Decimal("0.5")
    other = find(inputs(subject), lambda i: i["distance"] not in subject.stimuli["distance"].likely, settings=FEW)
    assert isinstance(other["distance"], Decimal) and other["distance"] * 10 % 1 == 0
    far = find(input_sequences(subject), lambda steps: steps[-1]["distance"] > 7, settings=FEW)
    assert [step["distance"] for step in far] == [Decimal("7.1")]


@pytest.mark.slow
def test_the_program_of_a_run_with_decimals_imports_them():
    subject = load(sensor("true", type=SPEED, init="0.5", internal=""), "slow: G (distance < 9.5)")
    run = find(runs(subject), lambda run: run.failure is not None, settings=FEW)
    assert run.program().startswith("from decimal import Decimal\n\nfrom llfsm_verify.testing import load\n")
    assert "run.ringlets(1, {'distance': Decimal('9.5')})" in run.program()


@pytest.mark.slow
def test_sequences_shrink_towards_few_steps_and_changes():
    strategy = input_sequences(sensor("distance > 7000"), max_size=6)
    assert find(strategy, lambda _: True, settings=FEW) == [{"distance": 500, "mode": "SLOW"}]
    found = find(strategy, lambda s: any(i["distance"] > 7000 for i in s[2:]), settings=FEW)
    assert len(found) == 3 and found[-1] == {"distance": 7001, "mode": "SLOW"}
    with pytest.raises(ValueError, match="at least one step"):
        find(input_sequences(sensor("true"), min_size=0), lambda _: True)


@given(input_sequences(load_arrangement("models/microwave/arrangement.yaml"), min_size=20, max_size=20))
@settings(max_examples=examples(30))
def test_sequences_keep_their_values_mostly(sequence):
    changes = sum(a != b for a, b in pairwise(sequence))
    assert len(sequence) == 20 and changes <= 15


@pytest.mark.slow
def test_sequences_can_be_given_to_a_simulation():
    @given(input_sequences(load_arrangement("models/turtle/arrangement.yaml"), max_size=6))
    @settings(max_examples=10)
    def runs_through(sequence):
        simulation = load("models/turtle/arrangement.yaml").simulation.anew()
        for step in sequence:
            simulation.ringlet(step)
        assert simulation.steps == len(sequence)

    runs_through()


def guards_seen(subject, examples):
    """How often each transition's guard was true and false in random runs: (machine, state, transition) to both."""
    seen: dict[tuple[str, int, int], Counter[bool]] = {}

    @given(runs(subject, max_stretches=12))
    @settings(max_examples=examples, database=None, suppress_health_check=list(HealthCheck))
    def look(run):
        def note():
            for kind, machine, arguments in again.simulation.events:
                if kind == "guard":
                    state, transition, value = arguments
                    key = (subject.program.machines[machine].name, state, transition)
                    seen.setdefault(key, Counter())[bool(value)] += 1

        again = subject.start(run.free)
        for stretch in run.stretches:
            again.take(stretch, note)

    look()
    return seen


def missed(subject, seen):
    """Guards that were not seen both ways, but for those that are constant."""
    found = []
    for info in subject.program.machines:
        for state, row in enumerate(info.transitions):
            for number, transition in enumerate(row):
                if transition.text not in ("true", "false"):
                    ways = set(seen.get((info.name, state, number), ()))
                    found += [(info.name, info.states[state], number, way) for way in (True, False) if way not in ways]
    return found


@pytest.mark.slow
def test_every_guard_of_a_wide_sensor_goes_both_ways():
    subject = Subject(sensor("distance == 1234", "distance == -5", "far == 20000", "distance > 32766"))
    assert missed(subject, guards_seen(subject, 25)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "constant"),
    [
        ("traffic_lights", []),
        ("microwave", []),
        ("turtle", []),
        ("xray", []),
        # The recogniser is in ORANGE_BLOB_FOUND for one turn.
        ("ball_conditions", [("vision", "HOLD", 0, False)]),
    ],
)
def test_every_guard_of_the_case_studies_goes_both_ways(model, constant):
    subject = load(f"models/{model}/arrangement.yaml")
    assert missed(subject, guards_seen(subject, 250)) == constant
