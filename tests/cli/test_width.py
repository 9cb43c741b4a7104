"""Twelve machines with long names at 80 and at 60 columns: no line is wider, and no name is cut."""

from __future__ import annotations

import re

import pytest

from tests.cli.running import Done, llfsm_process

MACHINES = [f"conveyor_belt_controller_{i:02}" for i in range(12)]
STATES = ("WAITING_FOR_THE_NEXT_PARCEL", "MOVING_THE_PARCEL_ALONG")
MODEL = (
    "cycle_ms: 1\nwhiteboard:\n"
    "  parcel_waiting_at_entrance: {type: bool, role: input}\n"
    "  parcel_leaving_at_exit: {type: bool, role: input}\n"
    "  parcels_on_the_belt_by_now: {type: 0..12}\n  belts_in_motion_at_present: {type: 0..12}\n"
    "machines:\n"
    + "".join(f"  {name}: {{file: belt.machine.yaml}}\n" for name in MACHINES)
    + f"schedule: [{', '.join(MACHINES)}]\n"
)
BELT = f"""
machine: Belt
states:
  - name: {STATES[0]}
    transitions:
      - when: parcel_waiting_at_entrance && !parcel_leaving_at_exit && parcels_on_the_belt_by_now < 12
        to: {STATES[1]}
  - name: {STATES[1]}
    on_entry: parcels_on_the_belt_by_now += 1; belts_in_motion_at_present += 1;
    transitions:
      - {{when: parcel_leaving_at_exit, to: {STATES[0]}}}
    on_exit: parcels_on_the_belt_by_now -= 1; belts_in_motion_at_present -= 1;
"""
PROPERTY = "never_one: G !(parcels_on_the_belt_by_now == 1)"


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> str:
    folder = tmp_path_factory.mktemp("belts")
    (folder / "belts.yaml").write_text(MODEL)
    (folder / "belt.machine.yaml").write_text(BELT)
    return str(folder / "belts.yaml")


def table(done: Done) -> list[str]:
    """From the first configuration to the end of the table."""
    lines = done.stdout.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(("Initially", "step ")))
    end = next((i for i, line in enumerate(lines) if line.startswith("Violated")), len(lines))
    return lines[start:end]


@pytest.mark.slow
@pytest.mark.parametrize("width", [80, 60])
def test_traces_stay_readable(model, width):
    done = llfsm_process("verify", model, "-p", PROPERTY, COLUMNS=str(width))
    assert done.returncode == 1
    lines = table(done)
    assert max(map(len, lines)) <= width
    whole = set(re.findall(r"\w+", "\n".join(lines)))
    assert {*MACHINES[:3], *STATES, "parcel_waiting_at_entrance", "parcels_on_the_belt_by_now"} <= whole
    assert {word for word in whole if word.isupper() and len(word) > 1} == {*STATES}
    assert {word for word in whole if word.startswith("conv")} <= {*MACHINES}
    assert len([line for line in lines if line.strip().startswith("changes: parcels_on_the_belt_by_now: 0 → 1")]) == 1


@pytest.mark.parametrize("width", [80, pytest.param(60, marks=pytest.mark.slow)])
def test_runs_stay_readable(model, width):
    done = llfsm_process("simulate", model, "--steps", "40", "--seed", "3", COLUMNS=str(width))
    assert done.returncode == 0
    lines = table(done)
    assert max(map(len, lines)) <= width
    whole = set(re.findall(r"\w+", "\n".join(lines)))
    assert {*MACHINES, *STATES} <= whole and {word for word in whole if word.startswith("conv")} == {*MACHINES}


@pytest.mark.slow
def test_a_pipe_has_a_line_a_step(model):
    shown = table(llfsm_process("simulate", model, "--steps", "40", "--seed", "3", COLUMNS=""))
    shown = shown[: next(n for n, line in enumerate(shown) if line.startswith("Never visited: "))]
    lines = [line for line in shown if not line.startswith("─")]
    assert (
        len(lines) == 42 and len(shown) == 45
    )  # twelve machines: a rule after steps 12, 24 and 36 and "inputs" in lines[0] and "changes" in lines[0]
