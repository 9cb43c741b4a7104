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

from llfsm_verify.report.schema import SCHEMAS
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
    assert "→ CAR_WAITING" not in never and "Never visited: timer@CAR_WAITING" in never
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
    process = subprocess.Popen(ENDLESS, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
    assert process.stdout is not None and process.stderr is not None
    first = b"".join(process.stdout.readline() for _ in range(100))  # what is buffered after it is lost below
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 130 and errors == b"interrupted\n"
    rows = [line.split() for line in first.decode().splitlines() if not line.startswith("─")]
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
    assert lines.pop() == "Every state was visited."
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
    done = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ew@GREEN && timer.ran", "--for", "30s", "--hold", "2s")
    assert done.returncode == 0 and done.stdout.endswith("`ew@GREEN && timer.ran` is true after step 73.\n")
    assert done.stdout.splitlines()[-2].split()[:4] == ["73", "25", "24", "s"]
    same = llfsm("simulate", LIGHTS, "--seed", "1", "--steps", "73", "--hold", "2s").stdout.splitlines()
    assert [line.split() for line in done.stdout.splitlines()[:-1]] == [line.split() for line in same[:-1]]
    at_once = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ew@RED", "-q")
    assert (at_once.returncode, at_once.stdout) == (
        0,
        "0 steps, 0 cycles, 0 s of logical time\n`ew@RED` is true in the initial configuration.\n",
    )
    never = llfsm("simulate", LIGHTS, "--seed", "1", "--until", "ns@GREEN && ew@GREEN", "-q", "--cycles", "20")
    assert never.returncode == 4 and never.stdout.splitlines() == [
        "60 steps, 20 cycles, 20 s of logical time",
        "`ns@GREEN && ew@GREEN` was not true within 60 steps: another seed, or more steps, may reach it.",
        "Never visited: timer@EW_TURN, ns@AMBER, ew@GREEN, ew@AMBER.",
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


def test_states_that_were_never_visited_are_said_in_every_format(tmp_path):
    never = ["simulate", LIGHTS, "--cycles", "9", "--seed", "1", "--draw", "car=0"]
    states = {"timer": ["CAR_WAITING", "EW_TURN"], "ns": ["AMBER"], "ew": ["GREEN", "AMBER"]}
    said = f"Never visited: {', '.join(f'{machine}@{s}' for machine in states for s in states[machine])}.\n"
    assert llfsm(*never, "-q").stdout.splitlines(keepends=True)[1:] == [said]
    assert llfsm(*never).stdout.endswith(f"\n{said}")
    told = llfsm(*never, "--format", "json")
    assert json.loads(told.stdout)["never_visited"] == states and told.stderr == ""
    rows = llfsm(*never, "--format", "csv", "-o", str(tmp_path / "rows.csv"))
    assert (rows.stdout, rows.stderr) == ("", said)


@pytest.mark.slow
@pytest.mark.parametrize("command", [("simulate",), ("run", "--simulate", "--for", "1s", "--rate", "0"), ("debug",)])
@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--hold", "5"), "--hold `5` is neither a time such as 5s, a number of cycles such as 20cycles, nor `none`"),
        (("--draw", "cra=0.1"), "--draw `cra` is not an input of the arrangement; inputs: car; did you mean `car`?"),
        (("--draw", "car=7"), "--draw car: `7` is not a probability, a number from 0 to 1"),
        (("--draw", "car=1", "--draw", "car=1"), "--draw gives `car` twice: leave one out"),
    ],
)
def test_wrong_laws_are_usage(command, option, message):
    done = llfsm(command[0], LIGHTS, *command[1:], "--seed", "1", *option)
    assert done.returncode == 2 and done.stderr.startswith(f"error: {message}")


def test_what_is_not_drawn_has_no_law():
    done = llfsm("simulate", LIGHTS, "--set", "car=true", "--draw", "car=0.5")
    assert done.returncode == 2 and "--draw `car` has a value" in done.stderr
    assert "--hold and --draw are for --simulate" in llfsm("run", LIGHTS, "--hold", "5s").stderr
    assert "--hold and --draw say how --seed draws inputs" in llfsm("debug", LIGHTS, "--draw", "car=1").stderr


@pytest.mark.slow
def test_a_crossing_is_crossed_when_inputs_are_held():
    """Drawn anew in every cycle, the ambulance comes so often that nobody ever walks."""
    run = ["simulate", "tests/cli/crossing.yaml", "--seed", "7", "--for", "10min", "-q"]
    assert llfsm(*run).stdout.endswith("Every state was visited.\n")
    assert llfsm(*run, "--draw", "ambulance=0.02").stdout.endswith("Every state was visited.\n")
    assert llfsm(*run, "--hold", "none").stdout.endswith("Never visited: road@AMBER, road@RED, feet@WALKING.\n")
