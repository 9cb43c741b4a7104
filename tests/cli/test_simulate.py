from __future__ import annotations

from tests.cli.running import LIGHTS, llfsm

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


def test_so_many_steps_or_cycles():
    assert len(steps(llfsm("simulate", LIGHTS, "--steps", "7", "--seed", "1").stdout)) == 8
    assert len(steps(llfsm("simulate", LIGHTS, "--cycles", "5", "--seed", "1").stdout)) == 16
    assert len(steps(llfsm("simulate", LIGHTS).stdout)) == 21


def test_a_seed_repeats_the_run():
    first, second = (llfsm("simulate", LIGHTS, "--cycles", "20", "--seed", "5") for _ in range(2))
    assert first.stdout == second.stdout and first.stderr == ""
    other = llfsm("simulate", LIGHTS, "--cycles", "20")
    assert other.stderr.startswith("seed ")
    again = llfsm("simulate", LIGHTS, "--cycles", "20", "--seed", other.stderr.split()[1])
    assert again.stdout == other.stdout


def test_inputs_can_be_held():
    never = llfsm("simulate", LIGHTS, "--cycles", "30", "--set", "car=false", "--seed", "1").stdout
    assert "CAR_WAITING" not in never
    always = llfsm("simulate", LIGHTS, "--cycles", "30", "--set", "car=true", "--seed", "1").stdout
    assert "→ CAR_WAITING when car" in steps(always)[1]


def test_inputs_from_a_file_hold_until_changed(tmp_path):
    path = tmp_path / "inputs.yaml"
    path.write_text("1: {car: false}\n7: {car: true}\n")
    lines = steps(llfsm("simulate", LIGHTS, "--cycles", "4", "--inputs", str(path), "--seed", "1").stdout)
    assert "car = false" in lines[4] and "CAR_WAITING when car" in lines[7]
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
