"""`llfsm build --monitor`: the promise comes first, and one bad property keeps all from being written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.running import llfsm

OVEN = "models/microwave/arrangement.yaml"
LIFT = "models/lift/arrangement.yaml"
C = ("--target", "c", "--for", "none", "--output")
BOARD = """
name: a
cycle_ms: 10
whiteboard: {n: {type: int}, go: {type: bool, role: input}}
types: {verdict: [GOOD, BAD]}
machines: {m: {inline: {machine: M, states: [{name: S, internal: "n = 3;", stays: true}]}}}
schedule: [m]
"""


def test_the_promise_is_printed_before_the_files_are_written(tmp_path):
    done = llfsm("build", OVEN, *C, str(tmp_path), "--monitor", "properties/microwave.ltl")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[:2] == [
        "property                 states  atoms  tables  RAM", "R1_sets_a_minute              4      4    48 B  5 B",
    ]  # fmt: skip
    assert re.fullmatch(r"23 monitors: \d+ bytes of tables, 120 bytes of RAM, at most \d+ operations a step", lines[24])
    assert lines[25:27] == ["", f"written: {tmp_path / 'microwave.h'}"]
    assert lines[-1] == "Call microwave_monitored_cycle once in 1000 ms."
    assert lines[24] in (tmp_path / "microwave_monitors.h").read_text()


def test_all_bad_properties_are_told_and_nothing_is_written(tmp_path):
    file = tmp_path / "bad.ltl"
    file.write_text("good: G (motor != STOP -> shut)\nin_shaft: G !env@CRASHED\nserved: G F motor != STOP\n"
                    "wide: G (shut -> X[12] (level && X[2] shut)) && G !gone\n")  # fmt: skip
    done = llfsm("build", LIFT, *C, str(tmp_path / "made"), "--monitor", str(file))
    assert (done.returncode, done.stdout) == (3, "")
    found = re.findall(r"bad\.ltl:(\d+):(\d+): error\[(\w+)\]", done.stderr)
    assert found == [("2", "14", "E515"), ("4", "52", "E110")]
    file.write_text(file.read_text().replace("gone", "shut"))
    done = llfsm("build", LIFT, *C, str(tmp_path / "made"), "--monitor", str(file))
    found = re.findall(r"bad\.ltl:(\d+):(\d+): error\[(\w+)\]", done.stderr)
    assert found == [("2", "14", "E515"), ("3", "9", "E432")]
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("lines", "code", "why"),
    [
        (["G n + 1 > 3"], "E517", "may leave 64 bits"), (["x-1: G go", "x_1: G !go"], "E504", "property `x_1`"),
        (["G F go"], "E432", "is not monitorable"), (["F G go"], "E432", "is not monitorable"),
        (["G (go -> G go) && F G !go && (G F go -> F go)", "!"], "E320", "is missing"), (["G gone"], "E110", "gone"),
        (["x: F go", "assume y: G m@NOWHERE"], "E112", "NOWHERE"),
        (["G (go -> F[0:999] n > 1) && G (n < 2 -> F[0:998] !go) && G (!go -> F[0:997] n > 3)"], "E516", "too large"),
        (["F go"], "E504", "`a_verdict`"), (["automaton x: \"no.hoa\""], "E301", "no.hoa"),
        (["enforce x: (go"], "E3", "")
    ],
)  # fmt: skip
def test_a_property_that_no_image_can_decide_is_refused(lines, code, why, tmp_path):
    (tmp_path / "a.yaml").write_text(BOARD if "a_verdict" in why else BOARD.replace("verdict:", "kind:"))
    words = [word for line in lines for word in ("-p", line)]
    done = llfsm("build", str(tmp_path / "a.yaml"), *C, str(tmp_path / "made"), *words)
    assert (done.returncode, done.stdout) == (3, "")
    assert f"error[{code}" in done.stderr
    assert why in done.stderr
    assert not (tmp_path / "made").exists()


def test_a_file_without_a_property_is_wrong_usage(tmp_path):
    (tmp_path / "none.ltl").write_text("assume x: G !button\n")
    done = llfsm("build", OVEN, *C, str(tmp_path / "made"), "--monitor", str(tmp_path / "none.ltl"))
    assert (done.returncode, done.stderr) == (2, "error: --monitor: there is no property\n")
    assert not Path(tmp_path / "made").exists()


def test_properties_are_chosen_by_name(tmp_path):
    """Those that cannot be monitored are left out so."""
    words = ("build", LIFT, *C, str(tmp_path), "--monitor", "properties/lift.ltl", "--only", "shut_moving")
    done = llfsm(*words, "--only", "level_open")
    assert done.returncode == 0
    assert "\n2 monitors: " in done.stdout
    done = llfsm("build", LIFT, *C, str(tmp_path), "--only", "level_open")
    assert (done.returncode, done.stderr) == (2, "error: --only chooses properties of --monitor\n")
