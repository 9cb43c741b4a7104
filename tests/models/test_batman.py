"""The clearances of the behaviours: nobody but the arbiter writes the motor, or the text is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError

FOLDER = Path("models/batman")


@pytest.fixture
def copy(tmp_path):
    for file in FOLDER.glob("*.yaml"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


@pytest.mark.parametrize("behaviour", ["wander", "charge", "avoid", "halt"])
def test_a_behaviour_that_writes_the_motor_is_refused(behaviour, copy):
    machine = copy / f"{behaviour}.machine.yaml"
    text = machine.read_text(encoding="utf-8").replace("slots[level].act = ", "motor = WALK; slots[level].act = ", 1)
    machine.write_text(text, encoding="utf-8")
    with pytest.raises(DiagnosticError) as refused:
        load_arrangement(copy / "arrangement.yaml")
    assert [d.code for d in refused.value.diagnostics] == ["E157"]


def test_the_faulty_version_that_bypasses_the_arbiter_would_be_refused(copy):
    arrangement = copy / "arrangement.yaml"
    text = arrangement.read_text(encoding="utf-8").replace("file: halt.machine", "file: bypass_halt.machine")
    arrangement.write_text(text, encoding="utf-8")
    with pytest.raises(DiagnosticError) as refused:
        load_arrangement(arrangement)
    assert [d.code for d in refused.value.diagnostics] == ["E157"]
