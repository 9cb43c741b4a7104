"""`llfsm guard`: its files and exit codes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from llfsm_verify.cli import main
from llfsm_verify.extensions.guards.guardable import Guardable
from llfsm_verify.extensions.guards.run import _listed, _proved
from tests.cli.running import llfsm
from tests.cli.test_decided import LINE
from tests.report.results import GOOD

OVEN = "models/microwave/faulty_R5.yaml"
CLOSED = "closed: G (door_open -> !motor)"


def guard(*arguments):
    return main(["guard", OVEN, "-p", CLOSED, *arguments])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "--fallback OUTPUT=VALUE is missing"),
        (["--fallback", "motor"], "--fallback needs OUTPUT=VALUE"),
        (["--fallback", "motor="], "the value is missing"),
        (
            ["--fallback", "motor=false", "--fallback", "motor=true"],
            "`motor` twice: give one value, which may be",
        ),
        (["--fallback", "motor=false", "-o", ""], "-o needs the name of a folder"),
        (["--fallback", "motor=false", "--for", "2s", "--until", "button"], "give one"),
        (["--fallback", "motor=false", "--no-proof"], "say where with -o FOLDER"),
        (["--fallback", "motor=false", "--only", "open"], "--only: there is no property `open`"),
        (["--fallback", "motor=false", "--react", "halt cooking"], "the commands are suspend, resume, restart, load"),
        (["--fallback", "motor=false", "--react", "suspend"], "such as 'suspend M'"),
        (["--fallback", "motor=false", "--react", ""], "such as 'suspend M'"),
        (["--react", "suspend cooking"], "--fallback OUTPUT=VALUE is missing"),
        (["--fallback", "motor=false", "--monitor", "m.machine.yaml", "--for", "2s"], "leave out --for and --until"),
    ],
)
def test_wrong_usage_is_said(capsys, arguments, said):
    assert guard(*arguments) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--fallback", "door=false"], "E439"),
        (["--fallback", "lamp=false"], "E437"),
        (["--fallback", "motor=false", "-p", "G F motor"], "E437"),
        (["--fallback", "motor=false", "-p", "assume a: G F cooking@COOKING"], "E438"),
        (["--fallback", "motor=false)"], "E101"),
        (["--fallback", "motor=3"], "E12"),
        (["--fallback", "motor=false", "--react", "suspend kooking"], "E439"),
        (["--fallback", "motor=false", "--react", "load switch"], "E438"),
    ],
)
def test_what_is_wrong_is_said_with_its_code(capsys, arguments, code):
    assert guard(*arguments) == 3
    assert f"error[{code}" in capsys.readouterr().err


def test_who_may_undo_a_reaction_is_noted(capsys, tmp_path):
    write = ("--fallback", "motor=false", "--no-proof", "-o")
    assert guard(*write, str(tmp_path / "a"), "--react", "suspend cooking") == 0
    assert "note" not in capsys.readouterr().err
    copytree(Path(OVEN).parent, tmp_path / "ovens")
    operated = tmp_path / "ovens" / "operated.yaml"
    operated.write_text(Path(OVEN).read_text() + "operators: {resume: [cooking]}\n")
    assert main(["guard", str(operated), "-p", CLOSED, *write, str(tmp_path / "b"), "--react", "suspend cooking"]) == 0
    assert "note: others also command `cooking`" in capsys.readouterr().err


@pytest.mark.slow
def test_no_other_file_is_replaced(capsys, tmp_path):
    folder = tmp_path / "safe"
    write = ("--fallback", "motor=false", "--no-proof", "-o", str(folder))
    assert guard(*write) == 0
    kept = {path.name: path.read_text() for path in folder.iterdir()}
    assert set(kept) == {
        "faulty_R5.yaml",
        *(f"{name}.machine.yaml" for name in ("monitor", "switch", "light", "beeper", "timer")),
    }
    assert guard(*write) == 0
    (folder / "switch.machine.yaml").write_text("mine")
    assert guard(*write) == 3
    assert "E440" in capsys.readouterr().err
    assert {path.name: path.read_text() for path in folder.iterdir()} == {**kept, "switch.machine.yaml": "mine"}


def test_the_list_says_what_can_be_guarded(capsys):
    assert guard("--list") == 0
    assert guard("-p", "G F motor", "--list") == 1
    assert capsys.readouterr().out.splitlines()[0] == "guardable      closed  by routing motor"


def test_the_list_goes_on_past_an_assumption_that_cannot_be_made(capsys):
    assert guard("-p", "assume busy: G F cooking@COOKING", "-p", "assume b: G F button", "--list") == 1
    printed, errors = capsys.readouterr()
    assert errors == ""
    assert printed.splitlines()[1:] == [
        "not assumable  busy    `cooking@COOKING` asks what a machine does, and others stand in its place in the proof"
    ]


@pytest.mark.slow
def test_limits_leave_it_unknown(capsys):
    assert guard("--fallback", "motor=false", "--engine", "explicit", "--max-states", "3") == 4
    assert Path(OVEN).exists()


@pytest.mark.slow
def test_a_policy_in_a_file_of_its_own_is_guarded_there(tmp_path):
    machine = "{inline: {machine: D, states: [{name: S, internal: speed = pedal;, stays: true}]}}"
    (tmp_path / "a.yaml").write_text(
        "name: a\ncycle_ms: 10\nwhiteboard:\n  pedal: {type: 0..9, role: input}\n  speed: {type: 0..9, role: output}\n"
        f"machines:\n  d: {machine}\nschedule: [d]\naccess: {{file: policy.yaml}}\n"
    )
    policy = "levels: [low, high] # two\nmachines: {d: high}\nwrite: {speed: high}\n"
    (tmp_path / "policy.yaml").write_text(policy)
    done = llfsm(
        "guard", str(tmp_path / "a.yaml"), "-p", "G speed < 5", "--fallback", "speed=4", "-o", str(tmp_path / "g")
    )
    assert done.returncode == 0, done
    assert (tmp_path / "g" / "policy.yaml").read_text() == (
        "levels: [low, high, guard] # two\nmachines: {d: high, monitor: guard, switch: guard}\n"
        "write: {speed: guard, alarm: guard, speed_requested: high}\n"
    )
    assert (tmp_path / "policy.yaml").read_text() == policy
    assert "access: {file: policy.yaml}" in (tmp_path / "g" / "a.yaml").read_text()


def test_a_mistake_in_a_fallback_is_shown_in_the_command(capsys, tmp_path):
    assert guard("--fallback", "motor=HALT", "-o", str(tmp_path / "a")) == 3
    said = capsys.readouterr().err
    assert said.startswith("--fallback motor:1:1: error[E110]") and "    1 | HALT\n" in said
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize("table", ["guard", "guardable"])
def test_a_long_name_does_not_make_rows_wide(table: str) -> None:
    """Its beginning and its end are shown, and the other rows are as wide as without its middle."""
    name = "first" + "n" * 5000 + "last"
    if table == "guard":
        printed = "".join(_proved((replace(GOOD, name=name), GOOD)))
    else:
        lines = (replace(LINE, name=name), LINE)
        printed = "".join(_listed([Guardable(line, ("x",), None) for line in lines]))
    assert max(map(len, printed.splitlines())) <= 120
    assert "first" + "n" * 25 in printed and "nlast" in printed
