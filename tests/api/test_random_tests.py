"""Models of the front door in random tests."""

from __future__ import annotations

import pytest
from hypothesis import find, settings
from hypothesis.stateful import run_state_machine_as_test

import llfsm_verify as lv
from llfsm_verify.testing import ArrangementStateMachine, RunFailed, inputs, load

QUIET = settings(database=None, derandomize=True)


def counter() -> lv.Model:
    step = lv.StateDefinition(internal="n = up ? n + 1 : 0;", transitions=[("false", "A")])
    board = {"n": {"type": "0..9", "init": 0}, "up": {"type": "bool", "role": "input"}}
    return lv.build("counter", {"m": lv.MachineDefinition("M", {"A": step})}, whiteboard=board)


def test_a_model_is_loaded_with_properties():
    run = load(counter(), "low: G n < 3").start()
    run.ringlets(2, {"up": True})
    assert run.simulation.values["n"] == 2
    with pytest.raises(TypeError, match="this is not an arrangement: 3"):
        load(3)  # type: ignore[arg-type]


def test_inputs_of_a_model():
    assert find(inputs(counter()), lambda given: given["up"] is True, settings=QUIET) == {"up": True}


@pytest.mark.slow
def test_a_state_machine_of_a_model():
    class Counting(ArrangementStateMachine):
        arrangement = counter()
        properties = "low: G n < 3"
        traces = None

    with pytest.raises(RunFailed) as caught:
        run_state_machine_as_test(
            Counting, settings=settings(Counting.TestCase.settings, derandomize=True, database=None)
        )
    assert caught.value.run.failure is not None and caught.value.run.failure.names == ("low",)
