from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from tests.cli.running import LIGHTS, llfsm
from tests.processes import ended

ENDLESS = [sys.executable, "-m", "llfsm_verify", "simulate", LIGHTS, "--steps", "1000000000", "--seed", "1"]

FAULTING = """
name: f
cycle_ms: 1
whiteboard: {d: {type: 0..1, init: 1, role: input}, x: {type: 0..9, init: 3}}
machines:
  m: {inline: {machine: M, states: [{name: A, internal: x = 6 / d;, transitions: [{when: x > 9, to: A}]}]}}
schedule: [m]
"""


def steps(output: str) -> list[str]:
    return [line for line in output.splitlines() if line[:4].strip().isdigit()]


@pytest.mark.slow
def test_so_many_steps_or_cycles():
    assert len(steps(llfsm("simulate", LIGHTS, "--steps", "7", "--seed", "1").stdout)) == 8
    assert len(steps(llfsm("simulate", LIGHTS, "--cycles", "5", "--seed", "1").stdout)) == 16
    assert len(steps(llfsm("simulate", LIGHTS).stdout)) == 21


@pytest.mark.slow
def test_a_seed_repeats_the_run():
    first, second = (llfsm("simulate", LIGHTS, "--cycles", "20", "--seed", "5") for _ in range(2))
    assert first.stdout == second.stdout and first.stderr == ""
    other = llfsm("simulate", LIGHTS, "--cycles", "20")
    assert other.stderr.startswith("seed ")
    again = llfsm("simulate", LIGHTS, "--cycles", "20", "--seed", other.stderr.split()[1])
    assert again.stdout == other.stdout


@pytest.mark.slow
def test_inputs_can_be_held():
    never = llfsm("simulate", LIGHTS, "--cycles", "30", "--set", "car=false", "--seed", "1").stdout
    assert "CAR_WAITING" not in never
    always = llfsm("simulate", LIGHTS, "--cycles", "30", "--set", "car=true", "--seed", "1").stdout
    assert "→ CAR_WAITING when car" in steps(always)[1]


def test_inputs_from_a_file_hold_until_changed(tmp_path):
    path = tmp_path / "inputs.yaml"
    path.write_text("1: {car: false}\n7: {car: true}\n")
    lines = steps(llfsm("simulate", LIGHTS, "--cycles", "4", "--inputs", str(path), "--seed", "1").stdout)
    assert "car = false" in lines[1] and "car = true" in lines[7] and "CAR_WAITING when car" in lines[7]
    path.write_text("soon: {car: true}\n2: {lorry: true}\n3: {car: perhaps}\n")
    done = llfsm("simulate", LIGHTS, "--inputs", str(path))
    assert done.returncode == 3 and all(
        code in done.stderr for code in (":1:1: error[E408]", ":2:5: error[E409]", ":3:5: error[E409]")
    )


def test_a_fault_ends_the_run():
    done = llfsm("simulate", "-", "--set", "d=0", "--seed", "1", stdin=FAULTING)
    assert done.returncode == 1 and "division by zero" in done.stdout and "FAULT" in done.stdout
    assert llfsm("simulate", "-", "--set", "d=1", "--seed", "1", stdin=FAULTING).returncode == 0


def test_the_end_of_an_arrangement_is_said():
    ending = FAULTING.replace("x > 9", "x == 3").replace("internal: x = 6 / d;, ", "").replace("to: A", "to: B")
    ending = ending.replace("}]}]}}", "}]}, {name: B}]}}")
    done = llfsm("simulate", "-", "--seed", "1", stdin=ending)
    assert done.returncode == 0 and "The arrangement ended after 2 steps." in done.stdout


@pytest.mark.slow
def test_rows_come_as_the_run_goes_and_an_interrupt_keeps_them():
    # Readline, which pytest loads, gives COLUMNS to processes that are not told their environment.
    environment = dict(os.environ)
    process = subprocess.Popen(ENDLESS, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None and process.stderr is not None
    first = [process.stdout.readline() for _ in range(100)]
    process.send_signal(signal.SIGINT)
    rest, errors = ended(process)
    assert process.returncode == 130 and errors == "interrupted\n"
    lines = "".join([*first, rest]).splitlines()
    finished = llfsm("simulate", LIGHTS, "--steps", "98", "--seed", "1").stdout.splitlines()
    assert [line.split() for line in lines[:100]] == [line.split() for line in finished]
    assert lines[1].split() == ["0", "initially"] and lines[99].split()[0] == "98"


@pytest.mark.slow
def test_a_reader_who_has_seen_enough_ends_the_run():
    read, write = os.pipe()
    process = subprocess.Popen(ENDLESS, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    os.read(read, 500)
    os.close(read)
    _, errors = ended(process)
    assert (process.returncode, errors) == (0, "")


@pytest.mark.slow
def test_columns_are_fixed_before_the_first_row():
    lines = llfsm("simulate", LIGHTS, "--steps", "300", "--seed", "2").stdout.splitlines()
    begins = {title: lines[0].index(title) for title in ("machine", "state", "fired", "inputs", "changes")}
    for line in lines[2:]:
        assert line[begins["machine"] - 1] == " " and line[begins["machine"]] in "tne"
        for title in ("fired", "inputs", "changes"):
            cell = line[begins[title] :]
            assert not cell or line[begins[title] - 2 : begins[title]] == "  "
            assert not cell.strip() or cell[0] != " " or title != "changes"
