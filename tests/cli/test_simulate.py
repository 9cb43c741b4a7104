from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.report.schemas import SCHEMAS
from tests.cli.running import FAULTY, LIGHTS, llfsm
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
    rows = [line.split() for line in "".join([*first, rest]).splitlines() if not line.startswith("─")]
    finished = steps(llfsm("simulate", LIGHTS, "--steps", "70", "--seed", "1").stdout)
    assert rows[1 : len(finished) + 1] == [line.split() for line in finished]
    assert rows[1] == ["0", "initially"] and rows[71][0] == "70"


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
    rules = [number for number, line in enumerate(lines) if line.startswith("─")]
    assert rules == list(range(5, len(lines), 4))  # after each cycle of three machines
    for line in (line for line in lines[2:] if not line.startswith("─")):
        assert line[begins["machine"] - 1] == " " and line[begins["machine"]] in "tne"
        for title in ("fired", "inputs", "changes"):
            cell = line[begins[title] :]
            assert not cell or line[begins[title] - 2 : begins[title]] == "  "
            assert not cell.strip() or cell[0] != " " or title != "changes"


def test_a_formula_ends_the_run():
    done = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ew@GREEN && timer.ran", "--for", "30s")
    assert done.returncode == 0 and done.stdout.endswith("`ew@GREEN && timer.ran` is true after step 55.\n")
    assert done.stdout.splitlines()[-2].split()[:4] == ["55", "19", "18", "s"]
    same = llfsm("simulate", LIGHTS, "--seed", "1", "--steps", "55").stdout.splitlines()
    assert [line.split() for line in done.stdout.splitlines()[:-1]] == [line.split() for line in same]
    at_once = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ew@RED", "-q")
    assert (at_once.returncode, at_once.stdout) == (
        0,
        "0 steps, 0 cycles, 0 s of logical time\n`ew@RED` is true in the initial configuration.\n",
    )
    never = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ns@GREEN && ew@GREEN", "-q", "--cycles", "20")
    assert never.returncode == 4 and never.stdout.splitlines() == [
        "60 steps, 20 cycles, 20 s of logical time",
        "`ns@GREEN && ew@GREEN` was not true within 60 steps: another seed, or more steps, may reach it.",
    ]


def test_what_cannot_be_looked_for_is_told():
    assert "error[E338]" in llfsm("simulate", LIGHTS, "--until", "F ew@GREEN").stderr
    assert "error[E110]" in llfsm("simulate", LIGHTS, "--until", "nothing").stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("--format", "mcap"),
        ("-q", "--format", "csv"),
        ("-o", "run.txt"),
        ("--from", "-"),
        ("--for", "3s", "--steps", "2"),
        ("--width", "3"),
    ],
    ids=" ".join,
)
def test_options_that_do_not_go_together(arguments):
    done = llfsm("simulate", LIGHTS, *arguments)
    assert done.returncode == 2 and done.stdout == ""


def test_a_time_needs_one_clock():
    untimed = FAULTING.replace("cycle_ms: 1\n", "timing: untimed\n").replace("x = 6 / d", "x = 3")
    assert "--for needs an arrangement with `cycle_ms`" in llfsm("simulate", "-", "--for", "3s", stdin=untimed).stderr
    several = FAULTING.replace("schedule: [m]", "processes: {a: [m], b: [n]}")
    assert llfsm("simulate", "-", "--for", "3s", stdin=several).returncode in (2, 3)


def test_inputs_by_time(tmp_path):
    path = tmp_path / "inputs.yaml"
    path.write_text("0s: {car: false}\n2s: {car: true}\n10: {car: false}\n")
    done = llfsm("simulate", LIGHTS, "--for", "4s", "--inputs", str(path), "--seed", "1")
    shown = [(line.split()[0], "car = true" in line) for line in steps(done.stdout) if "car =" in line]
    assert shown == [("1", False), ("7", True)] and len(steps(done.stdout)) == 13
    path.write_text("2s: {d: 1}\n")
    untimed = FAULTING.replace("cycle_ms: 1\n", "timing: untimed\n").replace("x = 6 / d", "x = 3 + d")
    assert "error[E408]" in llfsm("simulate", "-", "--inputs", str(path), stdin=untimed).stderr


def test_a_run_goes_on_where_a_trace_ends(tmp_path):
    trace = str(tmp_path / "both.trace.yaml")
    assert llfsm("query", FAULTY, "ns@GREEN && ew@GREEN", "--save", trace).returncode == 0
    done = llfsm("simulate", FAULTY, "--from", trace, "--seed", "1", "--steps", "3")
    rows = steps(done.stdout)
    assert [row.split()[0] for row in rows] == ["65", "66", "67", "68"] and rows[0].split() == [
        "65",
        "as",
        "the",
        "trace",
        "ends",
    ]
    assert rows[1].split()[1] == "ew" and rows[2].split()[:4] == ["67", "23", "22", "s"]
    csv = llfsm("simulate", FAULTY, "--from", trace, "--seed", "1", "--steps", "3", "--format", "csv")
    assert [line.partition(",")[0] for line in csv.stdout.splitlines()] == ["step", "65", "66", "67", "68"]
    value = json.loads(llfsm("simulate", FAULTY, "--from", trace, "--steps", "3", "--format", "json").stdout)
    assert [(s["step"], s["time_ms"]) for s in value["trace"]["steps"]] == [(66, 21000), (67, 22000), (68, 22000)]
    other = llfsm("simulate", "tests/outputs/door.yaml", "--from", trace)
    assert other.returncode == 3 and "error[E" in other.stderr
    damaged = re.sub(r", choices: \{car: [^}]*\}", "", Path(trace).read_text())
    Path(trace).write_text(damaged)
    done = llfsm("simulate", FAULTY, "--from", trace)
    assert done.returncode == 3 and "error[E411]" in done.stderr and "reads `car`, which the run does" in done.stderr


def test_runs_for_other_tools(tmp_path):
    command = ("simulate", LIGHTS, "--seed", "1", "--for", "2s")
    lines = llfsm(*command, "--format", "csv").stdout.splitlines()
    assert lines[0].startswith("step,cycle,time_ms,ns_turn")
    assert [line.split(",")[:3] for line in lines[1:]][4] == ["4", "2", "1000"]
    value = json.loads(llfsm(*command, "--format", "json").stdout)
    jsonschema.validate(value, SCHEMAS.load("simulation")("simulation"))
    assert (value["ending"], value["seed"], len(value["trace"]["steps"])) == ("steps", 1, 6)
    assert [(s["step"], s["time_ms"]) for s in value["trace"]["steps"]] == [
        (n, 0 if n < 4 else 1000) for n in range(1, 7)
    ]
    assert llfsm(*command, "-o", str(tmp_path / "run.itf.json")).returncode == 0
    states = json.loads((tmp_path / "run.itf.json").read_text())["states"]
    assert [state["ns"] for state in states] == [line.split(",")[8] for line in lines[1:]]
    fault = llfsm("simulate", "-", "--set", "d=0", "--seed", "1", "--format", "json", stdin=FAULTING)
    assert fault.returncode == 1 and json.loads(fault.stdout)["ending"] == "fault" and "division" in fault.stderr
