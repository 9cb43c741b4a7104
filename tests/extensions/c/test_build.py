"""`llfsm build`: what it writes, what it refuses, and that it touches no files of others."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from llfsm_verify.extensions.c.image import MARK
from llfsm_verify.targets.target import TARGETS
from tests.cli.running import llfsm
from tests.extensions.c.compiled import STRICT, compile_strictly, needs_gcc
from tests.outside import needs

OVEN = "models/microwave/arrangement.yaml"
C = ("--target", "c", "--for", "none", "--output")
MACHINE = """
machines:
  m:
    inline:
      machine: M
      states: [{name: A, transitions: [{when: true, to: B}]}, {name: B, transitions: [{when: true, to: A}]}]
schedule: [m]
"""


def said(*words: str) -> tuple[int, str, str]:
    """The exit code of `llfsm build`, and what it prints."""
    done = llfsm("build", *words)
    return done.returncode, done.stdout, done.stderr


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def build(folder: Path, text: str, *options: str) -> tuple[int, str, str]:
    """What the command says of an arrangement."""
    (folder / "a.yaml").write_text(text)
    return said(str(folder / "a.yaml"), *C, str(folder / "made"), *options)


@needs_gcc
def test_two_files_are_written_and_what_to_call_is_said(tmp_path):
    code, out, err = said(OVEN, *C, str(tmp_path))
    assert (code, err) == (0, "")
    files = ["microwave.h", "microwave.c"]
    assert out == "".join(f"written: {tmp_path / n}\n" for n in files) + "\nCall microwave_cycle once in 1000 ms.\n"
    assert names(tmp_path) == sorted(files)
    assert all(MARK in (tmp_path / name).read_text().splitlines()[0] for name in files)
    compile_strictly("gcc", tmp_path / "microwave.c", tmp_path / "oven.o")
    assert "-Werror" in STRICT


def test_the_same_arrangement_gives_the_same_files_again(tmp_path):
    assert said(OVEN, *C, str(tmp_path))[0] == 0
    before = {name: (tmp_path / name).read_bytes() for name in names(tmp_path)}
    assert said(OVEN, *C, str(tmp_path))[0] == 0
    assert before == {name: (tmp_path / name).read_bytes() for name in names(tmp_path)}


def test_what_the_model_of_the_surroundings_wrote_is_said_to_come_from_the_world(tmp_path):
    code, _, err = said("models/lift/arrangement.yaml", *C, str(tmp_path))
    assert code == 0
    left_out, kept = err.splitlines()
    assert left_out == "note: the model of the surroundings is left out: the inputs that it wrote come from the world"
    assert kept == "note: after a fault `motor`, `open` keep their values, since they have no `safe:`"


@pytest.mark.parametrize(
    ("outputs", "told"),
    [
        ("a: {type: bool, role: output}, b: {type: bool, role: output}", "`a`, `b` keep their values, since they have"),
        (
            "a: {type: bool, role: output}, b: {type: bool, role: output, safe: true}",
            "`a` keeps its value, since it has",
        ),
        ("a: {type: bool, role: output, safe: false}, b: {type: bool}", ""),
    ],
)
def test_outputs_that_a_fault_leaves_as_they_are_are_told(outputs, told, tmp_path):
    code, _, err = build(tmp_path, f"cycle_ms: 10\nwhiteboard: {{{outputs}}}\n{MACHINE}")
    assert (code, err) == (0, f"note: after a fault {told} no `safe:`\n" if told else "")


REFUSED = {
    "processes": (
        "cycle_ms: 10\n" + MACHINE.replace("schedule: [m]", "  k: {inline: {machine: K, states: [{name: S}]}}\n"
        "processes: {first: [m], second: [k]}"),
        "E503", "`second` is one of 2 processes",
    ),
    "model": ("cycle_ms: 10\n" + MACHINE.replace("  m:\n", "  m:\n    model: true\n"), "E503", "`m` is a model"),
    "reads": ("cycle_ms: 10\nprofile: clfsm\n" + MACHINE, "E503", "`snapshot: none`"),
    "replaced": ("cycle_ms: 10\noperators: {replace: [m]}\n" + MACHINE, "E503", "`replace` of `m`"),
    "untimed": ("timing: untimed\n" + MACHINE, "E483", "how long a cycle"),
    "inputs": (
        "cycle_ms: 10\nwhiteboard: {k: {type: {array: bool, size: 2}, role: input}, k_0: {type: bool, role: input}}\n"
        + MACHINE, "E504", "would both be `k_0`",
    ),
    "states": ("cycle_ms: 10\n" + MACHINE.replace("name: B,", "name: a__b,").replace("to: B", "to: a__b").replace(
        "name: A,", "name: a_b,").replace("to: A", "to: a_b"), "E504", "`a_b` of `m` and `a__b` of `m`"),
}  # fmt: skip
"""By what is wrong: the arrangement, the code, and what is said."""


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_meaning_in_one_image_is_refused(name, tmp_path):
    text, wanted, why = REFUSED[name]
    code, out, err = build(tmp_path, text)
    assert (code, out) == (3, "")
    assert f"error[{wanted}]" in err
    assert why in err
    assert not (tmp_path / "made").exists()


def test_an_untimed_arrangement_is_built_with_a_cycle(tmp_path):
    code, out, _ = build(tmp_path, "timing: untimed\n" + MACHINE, "--cycle-ms", "2.5")
    assert (code, "once in 2.5 ms" in out) == (0, True)
    assert "_PERIOD_NS UINT64_C(2500000)" in next((tmp_path / "made").glob("*.h")).read_text()


@needs_gcc
def test_names_that_c_keeps_are_taken(tmp_path):
    """Also names that are macros where headers of a controller are included before."""
    text = """
name: double
cycle_ms: 10
whiteboard:
  PORTB: {type: bool, role: input}
  char: {type: 0..9, role: output}
  errno: {type: int8}
machines:
  main:
    inline:
      machine: M
      variables: {state: {type: 0..3}, B0: {type: 0..3}}
      states:
        - {name: double, internal: "char = 3; state = 1; B0 = 2; errno = -1;", transitions: [{when: PORTB, to: PORTB}]}
        - {name: PORTB, transitions: [{when: true, to: B0}]}
        - {name: B0, transitions: [{when: true, to: main}]}
        - {name: main, transitions: [{when: true, to: double}]}
  outputs: {inline: {machine: N, states: [{name: S}]}}
schedule: [main, outputs]
"""
    code, _, err = build(tmp_path, text)
    assert code == 0, err
    header = tmp_path / "made" / "double.h"
    header.write_text("#define PORTB (1)\n#define B0 (2)\n#include <errno.h>\n" + header.read_text())
    compile_strictly("gcc", tmp_path / "made" / "double.c", tmp_path / "x.o")


@pytest.mark.parametrize("kind", ["file", "folder", "link"])
def test_files_of_others_are_left_as_they_are(kind, tmp_path):
    theirs = tmp_path / "microwave.c"
    if kind == "file":
        theirs.write_text("int mine;\n")
    elif kind == "folder":
        theirs.mkdir()
    else:
        theirs.symlink_to(tmp_path / "elsewhere")
    code, out, err = said(OVEN, *C, str(tmp_path))
    assert (code, out) == (3, "")
    assert "error[E505]: microwave.c is there already" in err
    assert names(tmp_path) == ["microwave.c"]
    assert kind != "file" or theirs.read_text() == "int mine;\n"


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = said(OVEN, *C, str(tmp_path / "file" / "made"))
    assert (code, "E505" in err) == (3, True)


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        (["--target", "c", "--for", "none"], "-o/--output"),
        (["--target", "rust", "--for", "none", "-o", "x"], "there is no `rust`; there are: c"),
        (["--target", "c", "--for", "moon", "-o", "x"], "--for moon: c is made for none, posix"),
        (["--target", "c", "--for", "none", "-o", "x", "--pins", "p.yaml"], "--pins needs --for avr"),
        (["--target", "c", "--for", "avr", "-o", "x", "--clock-hz", "3"], "--clock-hz 3: the clock"),
        (["--target", "c", "--for", "none", "-o", ""], "--output needs the name of a folder"),
        (["--target", "c", "--for", "none", "-o", "x", "--cycle-ms", "0"], "--cycle-ms"),
    ],
)
def test_wrong_usage(words, wrong):
    code, out, err = said(OVEN, *words)
    assert (code, out) == (2, "")
    assert wrong in err


@pytest.mark.parametrize("name", TARGETS)
def test_every_target_says_for_which_worlds_it_is_and_marks_its_files(name):
    target = TARGETS.load(name)
    assert target.worlds
    assert re.search("llfsm build", target.mark)


@needs("make")
@pytest.mark.parametrize("world", ["posix", "avr"])
def test_a_name_is_one_line_of_each_file_and_names_no_command_of_make(world, tmp_path):
    (tmp_path / "a.yaml").write_text(
        'name: "x\\n$(shell touch PWNED)\\n\\u2028$(shell touch PWNED)\\n\\u001b[2J\\u202e#\\\\"\ncycle_ms: 10\n'
        + MACHINE
    )
    (tmp_path / "pins.yaml").write_text("pins: {}\n")
    made = tmp_path / "made"
    assert said(str(tmp_path / "a.yaml"), "--target", "c", "--for", world, "-o", str(made))[0] == 0
    subprocess.run(["make", "-n", "CC=cc"], cwd=made, capture_output=True, check=True)
    assert not (made / "PWNED").exists()
    for path in made.iterdir():
        text = path.read_text()
        assert MARK in text.splitlines()[0]
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u2028\u202e]", text), path


@pytest.mark.parametrize("world", ["none", "posix", "avr"])
@pytest.mark.parametrize("name", ["é" * 1200, "*/" * 60, "é" * 70], ids=["longest", "slashes", "long"])
def test_files_of_a_long_name_are_written_again(world, name, tmp_path):
    (tmp_path / "a.yaml").write_text(f"name: '{name}'\ncycle_ms: 10\n" + MACHINE)
    (tmp_path / "pins.yaml").write_text("pins: {}\n")
    for _ in range(2):
        words = ("--target", "c", "--for", world, "-o", str(tmp_path / "made"))
        assert said(str(tmp_path / "a.yaml"), *words)[2] == ""
