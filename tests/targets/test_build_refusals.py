"""What `llfsm build` refuses: each with its code, its place and what to do, and names that it takes all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from llfsm_verify.cli.commands.build import run as command
from llfsm_verify.extensions.c.names import HEADERS
from tests.cli.running import llfsm
from tests.extensions.c.compiled import STRICT
from tests.outside import needs, program

BUILD = ("build", "a.yaml", "--target", "c", "--for", "none", "-o")
HEAD = "cycle_ms: 10\n"
BOARD = "whiteboard: {go: {type: bool, role: input}, on: {type: bool, role: output}}\n"
LAMP = """\
machines:
  m: {inline: {machine: M, states: [{name: A, on_entry: on = true;, transitions: [{when: go, to: B}]}, {name: B}]}}
schedule: [m]
"""
MODEL = LAMP.replace("m: {inline", "m: {model: true, inline")
PLAIN = HEAD + BOARD + LAMP
TWO = """\
  k: {inline: {machine: K, states: [{name: S}]}}
"""


def machine(states: str) -> str:
    return f"machines: {{m: {{inline: {{machine: M, states: [{states}]}}}}}}\nschedule: [m]\n"


def states(*names: str) -> str:
    """States, each of which goes on to the next."""
    pairs = zip(names, (*names[1:], names[0]), strict=True)
    return ", ".join(f"{{name: {a}, transitions: [{{when: true, to: {b}}}]}}" for a, b in pairs)


def machines(**given: tuple[str, ...]) -> str:
    """Machines by name, with their states."""
    made = (f"{m}: {{inline: {{machine: M_{m}, states: [{states(*names)}]}}}}" for m, names in given.items())
    return f"machines: {{{', '.join(made)}}}\nschedule: [{', '.join(given)}]\n"


def board(entries: str) -> str:
    return f"{HEAD}whiteboard: {{{entries}}}\n{machine(states('A', 'B'))}"


TEXTS = {
    "several processes": (
        HEAD + BOARD + LAMP.replace("schedule: [m]", TWO + "processes: {one: [m], two: [k]}"),
        "a.yaml:6:23: error[E503]: `two` is one of 2 processes", "one `schedule` for each image",
    ),
    "a machine that is a model": (
        HEAD + BOARD + MODEL,
        "a.yaml:4:3: error[E503]: `m` is a model of something else", "write the machine that runs in its place",
    ),
    "choose, in a model": (
        HEAD + BOARD + MODEL.replace("on = true;", '"on = choose(false, true);"'),
        "a.yaml:4:3: error[E503]: `m` is a model of something else", "leave it out",
    ),
    "reads that are samples": (
        HEAD + "profile: {base: llfsm, snapshot: none}\n" + BOARD + LAMP,
        "a.yaml:1:1: error[E503]: with `snapshot: none`", "write `profile: {base: llfsm, snapshot: ringlet}`",
    ),
    "reads of clfsm": (
        HEAD + "profile: clfsm\n" + BOARD + LAMP,
        "a.yaml:1:1: error[E503]: with `snapshot: none`", "write `profile: {base: clfsm, snapshot: ringlet}`",
    ),
    "a machine that operators replace": (
        HEAD + "operators: {replace: [m]}\n" + BOARD + LAMP,
        "a.yaml:2:23: error[E503]: an image cannot be changed while it runs", "leave out `replace`",
    ),
    "no length of a cycle": (BOARD + LAMP, "a.yaml:1:1: error[E483]: nothing says how long", "--cycle-ms 100"),
    "an array and a name like an element of it": (
        board("k: {type: {array: bool, size: 2}, role: input}, k_0: {type: bool, role: input}"),
        "error[E504]: input `k[0]` and input `k_0` would both be `k_0` in C", "give one of them another name",
    ),
    "variables that differ in underscores": (
        board("a_b: {type: bool}, a__b: {type: bool}"),
        "error[E504]: `a_b` and `a__b` would both be `a_b`", "another name",
    ),
    "a field and a name like it": (
        HEAD + "types: {P: {record: {x: bool}}}\n" + board("p: {type: P}, p_x: {type: bool}").removeprefix(HEAD),
        "error[E504]: `p.x` and `p_x` would both be `p_x`", "another name",
    ),
    "states that differ in underscores": (
        HEAD + machine(states("a_b", "a__b")), "error[E504]: `a_b` of `m` and `a__b` of `m`", "another name",
    ),
    "machines that differ in underscores": (
        HEAD + machines(a_b=("A", "B"), a__b=("A", "B")),
        "error[E504]: machine `a_b` and machine `a__b` would both be", "another name",
    ),
    "a machine and a state that are another machine's": (
        HEAD + machines(a=("b_A", "B"), a_b=("A", "B")),
        "error[E504]: `b_A` of `a` and `A` of `a_b` would both be", "another name",
    ),
    "an enumeration called like a struct": (
        HEAD + "types: {status: [GOOD, BAD]}\n" + board("s: {type: status}").removeprefix(HEAD),
        "error[E504]: a name of every image and the type of `status` would both be `x_status`", "another name",
    ),
    "an enumeration called like a function of ours": (
        "name: wide\n" + HEAD + "types: {add: [GOOD, BAD]}\n" + board("s: {type: add}").removeprefix(HEAD),
        "error[E504]: a function of every image and the type of `add` would both be `wide_add`", "another name",
    ),
    "a name that is not one": (board("größe: {type: bool}"), "a.yaml:2:14: error[E036]: `größe`", "digits and `_`"),
    **{
        f"an arrangement called {name}": (
            f"name: {name}\n{PLAIN}", f"a.yaml:1:1: error[E525]: an arrangement called `{name}` cannot be C: {why}",
            "give it another `name:`",
        )
        for name, why in {
            "signal": "its header would be signal.h", "stdint": "its header would be stdint.h",
            "Time": "its header would be Time.h", "sem": "names that begin with `sem_`",
            "pthread_mutex": "names that begin with `pthread_mutex_`", "int16": "names that begin with `int16_`",
        }.items()
    },
}  # fmt: skip
"""By what is wrong: the arrangement, what is said of it and where, and what to do."""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text("name: x\n" + PLAIN)
    return tmp_path


@pytest.mark.parametrize("case", TEXTS)
def test_what_cannot_be_is_refused_where_it_stands(case, here):
    text, wrong, todo = TEXTS[case]
    (here / "a.yaml").write_text(text if text.startswith("name:") or "a.yaml:" in wrong else "name: x\n" + text)
    done = llfsm(*BUILD, "made")
    assert (done.returncode, done.stdout) == (3, "")
    assert wrong in done.stderr
    assert todo in done.stderr.partition("hint: ")[2]
    assert not (here / "made").exists()


# ---------------------------------------------------------------- folders


def file(at: Path) -> None:
    at.write_text("mine\n")


def below(at: Path) -> None:
    file(at.parent / "file")


def dangling(at: Path) -> None:
    at.symlink_to("nowhere")


def with_folder(at: Path) -> None:
    (at / "x.h").mkdir(parents=True)


def with_link(at: Path) -> None:
    at.mkdir()
    assert llfsm(*BUILD, "ours").returncode == 0
    (at / "x.c").symlink_to(at.parent / "ours" / "x.c")


def with_pipe(at: Path) -> None:
    at.mkdir()
    os.mkfifo(at / "x.c")


def with_theirs(at: Path) -> None:
    at.mkdir()
    file(at / "x.h")


def with_bytes(at: Path) -> None:
    at.mkdir()
    (at / "x.h").write_bytes(b"\xff\x00" * 4000)


UNWRITTEN = "error[E505]: the files cannot be written there:"
FOLDERS = {
    "a file": (file, "made", f"made: {UNWRITTEN} File exists", "name a folder"),
    "below a file": (below, "file/made", f"{UNWRITTEN} Not a directory", "a file is"),
    "a link to nothing": (dangling, "made", f"made: {UNWRITTEN} File exists", "name a folder"),
    "a folder for a file": (with_folder, "made", "made: error[E505]: x.h is there already", "name another folder"),
    "a link to a file": (with_link, "made", "made: error[E505]: x.c is there already", "name another folder"),
    "a pipe": (with_pipe, "made", "made: error[E505]: x.c is there already", "name another folder"),
    "another's file": (with_theirs, "made", "made: error[E505]: x.h is there already", "name another folder"),
    "another's bytes": (with_bytes, "made", "made: error[E505]: x.h is there already", "name another folder"),
    "a long name": (lambda _: None, "n" * 300, f"{UNWRITTEN} File name too long", "shorter"),
}  # fmt: skip
"""By what is there: how it comes there, what is given as the folder, and what is said."""


def tree(folder: Path) -> dict[str, object]:
    """What lies there, and how."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        content = path.read_bytes() if path.is_file() and not path.is_symlink() else b""
        found[str(path)] = (status.st_mode, status.st_ino, content)
    return found


@pytest.mark.parametrize("case", FOLDERS)
def test_nothing_of_others_is_touched(case, here):
    prepare, given, wrong, todo = FOLDERS[case]
    prepare(here / "made")
    before = tree(here)
    done = llfsm(*BUILD, given)
    assert (done.returncode, done.stdout) == (3, "")
    assert wrong in done.stderr
    assert todo in done.stderr.partition("hint: ")[2]
    assert tree(here) == before


def test_others_files_beside_ours_stay(here):
    (here / "made").mkdir()
    file(here / "made" / "mine.c")
    assert llfsm(*BUILD, "made").returncode == 0
    assert (here / "made" / "mine.c").read_text() == "mine\n"


def test_what_an_earlier_build_left_is_said(here):
    assert llfsm("build", "a.yaml", "--target", "c", "--for", "posix", "-o", "made").returncode == 0
    (here / "made" / "x.c").unlink()
    done = llfsm(*BUILD, "made")
    assert done.returncode == 0
    assert "note: made/x_main.c is from an earlier build, and this one has nothing to do with it\n" in done.stderr
    assert (here / "made" / "x_main.c").exists()
    assert (here / "made" / "x.c").exists()


def test_a_folder_in_which_one_may_not_write_is_said(here, monkeypatch):
    def refused(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(command, "replacing", refused)
    done = llfsm(*BUILD, "made")
    assert done.returncode == 3
    assert "made: error[E505]: the files cannot be written there: Permission denied\n" in done.stderr
    assert "hint: name a folder in which you may write\n" in done.stderr


@pytest.mark.slow
def test_where_files_may_not_grow_the_old_ones_stay(here):
    assert llfsm(*BUILD, "made").returncode == 0
    before = tree(here / "made")
    (here / "a.yaml").write_text((here / "a.yaml").read_text().replace("name: B", "name: B, on_entry: on = false;"))
    line = f"ulimit -f 2; exec {sys.executable} -m llfsm_verify {' '.join(BUILD)} made"
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert "made: error[E505]: the files cannot be written there: File too large\n" in done.stderr
    assert "hint: make room, or name another folder\n" in done.stderr
    assert {path: kept[2] for path, kept in tree(here / "made").items()} == {p: kept[2] for p, kept in before.items()}


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        (("--target", "c", "--for", "none", "-o", "-"), "error: -o/--output needs the name of a folder"),
        (("--target", "c", "--for", "moon", "-o", "x"), "error: --for moon: c is made for none, posix"),
        (("--target", "ada", "--for", "none", "-o", "x"), "error: --target: there is no `ada`; there are: c"),
        (("--target", "c", "--for", "none", "-o", "x", "--cycle-ms", "nan"), "error: --cycle-ms: 'nan' is not"),
    ],
)
def test_wrong_words_say_which_there_are(words, wrong, here):
    done = llfsm("build", "a.yaml", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert wrong in done.stderr
    assert sorted(path.name for path in here.iterdir()) == ["a.yaml"]


# ---------------------------------------------------------------- names that are taken

ODD = """
    double main PORTB B0 EOF int16_t NULL _Bool class new errno INT16_MAX SIGTERM wchar_t size_t cli PRId8 unix
    state inputs status before wide add64 wrap32 min_16 ringlet observe outputs whiteboard control none typename
    uint64_t I complex st_atime template operator virtual restrict inline sei interrupts DDRB TCCR1A F_CPU OK ENDED
"""
"""Words of C and C++, macros of controllers, and names that our own functions use."""
AROUND = "".join(f"#include <{name}.h>\n" for name in ("errno", "stdio", "signal", "complex", "inttypes", "unistd"))


@needs("g++", "avr-gcc")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["double", "in_m", "run", "B0", "main", "1st", "EOF"])
def test_words_of_c_and_macros_of_controllers_can_be_names(name, here):
    odd = ODD.split()
    entries = ", ".join(f"{word}: {{type: int16, role: {('input', 'output')[i % 2]}}}" for i, word in enumerate(odd))
    body = " ".join(f"{word} = {other};" for word, other in zip(odd[1::2], odd[::2], strict=False))
    made = machines(m=(*odd, "step", "S"), float=("A", "B"))
    made = made.replace("name: double,", f"name: double, internal: {body},")
    (here / "a.yaml").write_text(f"name: {name}\n{HEAD}whiteboard: {{{entries}}}\n{made}")
    done = llfsm(*BUILD, "made")
    assert done.returncode == 0, done.stderr
    (source,), (header,) = (list((here / "made").glob(f"*.{end}")) for end in "ch")
    (here / "made" / "all.cpp").write_text(f'{AROUND}#include "{header.name}"\n')
    (here / "made" / "pins.c").write_text(f"#include <avr/io.h>\n#include <avr/interrupt.h>\n{source.read_text()}")
    for line in (
        [program("gcc"), *STRICT, "-I.", "-c", source.name],
        [program("g++"), *STRICT[1:], "-std=c++11", "-fsyntax-only", "all.cpp"],
        [program("avr-gcc"), *STRICT, "-mmcu=atmega328p", "-Os", "-c", "pins.c"],
    ):
        compiled = subprocess.run(line, cwd=here / "made", capture_output=True, text=True, check=False)
        assert compiled.returncode == 0, compiled.stderr[:3000]


def test_headers_are_those_of_this_machine():
    """Which has more, that no name of an arrangement is."""
    found = {path.stem for path in Path("/usr/include").glob("*.h")}
    if found:
        assert {"stdio", "signal", "string"} <= HEADERS & found
