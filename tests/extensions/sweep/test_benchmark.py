"""`python -m benchmarks.sweep` on a few checks."""

from __future__ import annotations

import json

import pytest

from benchmarks.sweep import main, tasks
from llfsm_verify.extensions.sweep.worker import perform


@pytest.mark.slow
def test_workers_are_measured_beside_one_process(capsys: pytest.CaptureFixture[str]) -> None:
    assert [perform(task).state for task in tasks(2)] == ["done", "done"]
    assert main(["--number", "2", "--rounds", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"one process", "one worker", "two workers", "times as fast with two workers"} < set(found)
    assert all(figure > 0 for name, figure in found.items() if "overhead" not in name)
