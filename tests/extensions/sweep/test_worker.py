"""A task performed: everything becomes an outcome, and files are called as in the task."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from llfsm_verify import load
from llfsm_verify.extensions.sweep import worker
from llfsm_verify.extensions.sweep.worker import guarded, peak, perform, reset_peak
from tests.extensions.sweep.tasks import FOLDER, ROOT, counter_task, lasting, lights_task, twelve


def verdicts(result: Any) -> dict[str, str]:
    return {item["name"]: item["verdict"] for item in result["properties"]}


def test_a_value_decides_the_verdict() -> None:
    found = {n: perform(counter_task(n)) for n in (4, 5)}
    assert {n: verdicts(outcome.result) for n, outcome in found.items()} == {
        4: {"below": "holds"},
        5: {"below": "violated"},
    }
    assert [outcome.state for outcome in found.values()] == ["done", "done"]
    assert found[4].traces == () and [name for name, _ in found[5].traces] == ["below"]
    assert "\narrangement: counter.yaml\n" in found[5].traces[0][1]
    assert found[4].seconds > 0 and found[4].memory > 1 << 20


@pytest.mark.slow
def test_the_result_is_that_of_a_check() -> None:
    outcome = perform(lights_task("a", "faulty.yaml"))
    checked = load(FOLDER / "faulty.yaml").check(ROOT / "properties" / "traffic_lights.ltl")
    expected = json.loads(checked.to_json().replace(f"{FOLDER}/", "").replace(f"{ROOT}/properties/", "asked/"))
    expected = json.loads(json.dumps(expected).replace("asked/traffic_lights.ltl", "asked/p.ltl"))
    assert lasting(outcome) == lasting(replace(outcome, result=expected))


def test_what_is_wrong_is_said_with_the_names_of_the_task() -> None:
    outcome = perform(counter_task(3, values=(("constant", "most", 17),)))
    assert outcome.state == "failed" and "17" in outcome.message and "llfsm-sweep" not in outcome.message
    result: Any = outcome.result
    assert result["exit_code"] == 3 and result["error"]["diagnostics"]
    outcome = perform(counter_task(3, properties=("gone.ltl",)))
    assert outcome.message.startswith("gone.ltl: error[E301]: there is no such file")
    outcome = perform(counter_task(3, values=(("initial", "m", 1),)))
    assert (outcome.state, outcome.message) == ("failed", "there is no initial `m`; there are: n")


@pytest.mark.parametrize("path", ["../a.yaml", "/a.yaml", "a/../../b.yaml"])
def test_a_file_outside_is_refused(path: str) -> None:
    outcome = perform(counter_task(3, files=((path, ""),)))
    assert outcome.state == "failed" and f"the file {path} of a task is not below its folder" in outcome.message


@pytest.mark.slow
def test_limits_are_states() -> None:
    outcome = perform(lights_task("a", timeout=1e-9))
    assert outcome.state == "timeout" and "the time limit of 1e-09 s was reached" in outcome.message
    assert set(verdicts(outcome.result).values()) == {"unknown"}
    outcome = perform(lights_task("a", memory=1 << 20))
    assert outcome.state == "memory" and "the memory limit of 1 MiB was reached" in outcome.message
    assert perform(lights_task("a", options=(("engine", "explicit"), ("max_states", 2)))).state == "done"


def test_errors_of_ours_are_outcomes(monkeypatch: pytest.MonkeyPatch) -> None:
    for error, state, said in (
        (MemoryError(), "memory", "out of memory"),
        (RuntimeError("this\n  and that"), "failed", "internal error: RuntimeError: this and that"),
        (KeyboardInterrupt(), "failed", "interrupted"),
    ):

        def fails(_: object, error: BaseException = error) -> None:
            raise error

        monkeypatch.setattr(worker, "resolve", fails)
        outcome = guarded(counter_task(3, timeout=100))
        assert (outcome.state, outcome.result, outcome.message) == (state, None, said)
    monkeypatch.undo()
    outcome = perform(counter_task(3, options=(("nonsense", 1),)))
    assert outcome.state == "failed" and "check has no option `nonsense`" in outcome.message


def test_the_peak_is_that_of_a_task() -> None:
    reset_peak()
    before = peak()
    data = bytearray(64 << 20)
    data[:: 1 << 12] = b"1" * len(data[:: 1 << 12])
    most = peak()
    del data
    reset_peak()
    assert before + (60 << 20) < most and peak() < most - (30 << 20)


@pytest.mark.slow
def test_the_tasks_of_other_tests_have_all_ends() -> None:
    outcomes = [perform(task) for task in twelve()]
    assert [each.state for each in outcomes].count("failed") == 2
    assert {len(each.traces) for each in outcomes} > {0, 1}
