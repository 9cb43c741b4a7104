"""Built images are run on vectors: what is equal, what differs and where, what is missing, and what it costs."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify.analysis.coverage.vectorfile import vectors_text
from llfsm_verify.analysis.coverage.vectors import Vectors
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.extensions.c.loop import quoted
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.extensions.c.verifying.harness import Harness
from llfsm_verify.extensions.c.verifying.run import Bench, on_computer
from llfsm_verify.extensions.c.verifying.vectors import all_steps, drawn
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted
from tests.cli.running import llfsm
from tests.extensions.c.compiled import needs_gcc, write
from tests.outside import needs

OVEN = "models/microwave/arrangement.yaml"
EVERYTHING = "tests/extensions/c/everything.yaml"
LINES = re.MULTILINE


def on_gcc(options: str) -> Bench:
    return on_computer(Wanted("none", compiler=f"gcc {options}"))


NATIVE = on_gcc("-Wall -Wextra -Wconversion -pedantic -Werror")
SMALL = """
name: small
cycle_ms: 1000
whiteboard:
  go: {type: bool, init: false, role: input}
  shown: {type: -3..300, init: -3, role: output, safe: -3}
machines:
  m:
    inline:
      machine: M
      variables: {n: {type: 0..9, init: 4}}
      states:
        - {name: A, internal: "n = n + 1;", transitions: [{when: go, to: B}, {when: n == 8 and after(2), to: A}]}
        - {name: B, on_entry: "shown = n * 33;", internal: "n = n / 2; shown = -n;",
           transitions: [{when: not go, to: A}]}
schedule: [m]
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    path = tmp_path_factory.mktemp("small") / "small.yaml"
    path.write_text(SMALL)
    return image_for(image_of(load_arrangement(path)))


def texts(image: Image) -> tuple[str, str]:
    source = image.source()
    return image.header(), source


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("unit", ["ringlet", "cycle"])
def test_all_steps_of_a_small_image_are_equal_in_one_part_or_many(unit, small):
    vectors = all_steps(small.program, unit)
    assert vectors is not None
    assert any(s.fault for s in vectors.sequences)
    count = sum(len(s.inputs) for s in vectors.sequences)
    assert NATIVE.run(small, texts(small), vectors).steps == count
    parts = Harness(small, vectors, 300).parts
    assert len(parts) > 3
    assert sorted({run[0] for part in parts for run in part.runs}) == list(range(len(vectors.sequences)))


def test_all_steps_are_those_that_the_executor_expands(small):
    from llfsm_verify.backends.native.executor import NativeProgram

    native, vectors = NativeProgram(small.program), all_steps(small.program, "ringlet")
    assert vectors is not None
    seen, todo, count = {native.layout.first()}, [native.layout.first()], 0
    while todo:
        for edge in native.successors(todo.pop()):
            count += 1
            if edge.status == 0 and edge.record not in seen:
                seen.add(edge.record)
                todo.append(edge.record)
    assert sum(len(s.inputs) for s in vectors.sequences) == count
    assert all_steps(small.program, "ringlet", count - 1) is None


@needs_gcc
@pytest.mark.slow
def test_drawn_vectors_of_everything_are_equal():
    image = image_for(image_of(load_arrangement(EVERYTHING)))
    for unit in ("ringlet", "cycle"):
        vectors = drawn(image.program, unit)
        assert {s.fault for s in vectors.sequences} != {0}
        assert NATIVE.run(image, texts(image), vectors).difference is None


MUTANTS = [
    (r"\+ 1\)", "+ 2)"), (r"\* 33", "* 34"), (r" > 9", " > 10"), (r"return 1;", "return 2;"),
    (r"shown = 0?-?", "shown = 1 + "),
    (r"entered_ = true", "entered_ = false"), (r"= small_m_A;", "= small_m_B;"), (r"/ 2", "/ 3"),
    (r"done = 2", "done = 1"),
    (r"control\.cycle = true", "control.cycle = false"), (r"\*state = before;", ""), (r"shown = \(-3\)", "shown = 3"),
    (r"clock_ = 0", "clock_ = 1"), (r"\(int16_t\)", "(int8_t)"),
]  # fmt: skip


@needs_gcc
@pytest.mark.slow
def test_each_mutant_of_an_image_is_caught(small):
    header, source = texts(small)
    vectors = all_steps(small.program, "ringlet")
    assert vectors is not None
    lenient = on_gcc("-O0 -w")
    changes = [(old, new, re.sub(old, new, source)) for old, new in MUTANTS]
    assert sum(changed != source for _, _, changed in changes) > 9
    for old, new, changed in changes:
        if changed == source:
            continue  # it is written in another way now
        assert lenient.run(small, (header, changed), vectors).difference is not None, (old, new)


@needs_gcc
def test_the_first_difference_is_told_with_its_place(small):
    vectors = drawn(small.program, "ringlet", sequences=3, steps=9)
    index = vectors.fields.index("shown")
    second = vectors.sequences[1]
    rows = [list(row) for row in second.records]
    rows[4][index] += 1
    changed = replace(second, records=tuple(map(tuple, rows)))
    other = replace(vectors, sequences=(vectors.sequences[0], changed, vectors.sequences[2]))
    found = NATIVE.run(small, texts(small), other).difference
    assert found is not None
    assert (found.sequence, found.step, found.field) == (2, 5, "shown")
    assert int(found.expected) == int(found.found) + 1
    wrong = replace(
        vectors, sequences=(replace(second, inputs=second.inputs[:3], records=second.records[:2], fault=1),)
    )
    assert str(NATIVE.run(small, texts(small), wrong).difference) == (
        "sequence 1 differs in step 3: status is OK, expected fault 1"
    )


def test_vectors_of_another_image_are_refused(small):
    vectors = drawn(small.program, "ringlet", sequences=1, steps=2)
    with pytest.raises(ValueError, match="have not the inputs"):
        Harness(small, replace(vectors, fields=vectors.fields[1:]))


# ------------------------------------------------------------ the command


def said(*words: str) -> tuple[int, str, str]:
    done = llfsm("build", *words)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def path(tmp_path) -> str:
    (tmp_path / "small.yaml").write_text(SMALL)
    return str(tmp_path / "small.yaml")


@needs_gcc
@pytest.mark.slow
def test_the_command_says_what_was_compared_and_that_it_is_all(path):
    code, out, err = said(path, "--target", "c", "--for", "none", "--verify")
    assert (code, err) == (0, "")
    assert re.fullmatch(
        r"Verified on cc: \d+ ringlets and \d+ cycles, 0 differences\.\n"
        r"These are all ringlets that there can be, .*\nThese are all cycles that there can be, .*\n", out
    )  # fmt: skip


WATCHED = ("--property", "p: G !(shown > 200 && go)", "--property", "q: G (m@B -> m.n < 9)")


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("world", ["none", "posix", pytest.param("avr", marks=needs("avr-gcc", "simavr"))])
def test_an_image_with_monitors_is_verified_without_them_and_that_is_said(world, path, tmp_path):
    (tmp_path / "pins.yaml").write_text("pins: {go: PB0}\n")
    code, out, err = said(path, "--target", "c", "--for", world, "--verify", *WATCHED)
    assert (code, err) == (0, "")
    assert re.search(r"^Verified on .*: \d+ ringlets and \d+ cycles, 0 differences\.$", out, LINES)
    told = "The monitors were not run: no verdict is compared, and no time has that of small_monitors_step in it."
    assert told in out.splitlines()


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("optimize", ["speed", "size"])
def test_an_image_with_monitors_is_verified(optimize, path):
    """Of its atoms one reads an input, which the image decides in its steps, and one does not."""
    rules = ("-p", "low: G (shown < 299)", "-p", "goes: G (go -> shown < 299)")
    code, out, err = said(path, "--target", "c", "--for", "none", "--optimize", optimize, *rules, "--verify")
    assert (code, err) == (0, "")
    assert re.search(r"^Verified on cc: \d+ ringlets and \d+ cycles, 0 differences\.$", out, LINES)


@needs_gcc
@pytest.mark.slow
def test_vectors_of_a_file_are_run(path, tmp_path):
    file = tmp_path / "v.json"

    def ask(given: Vectors) -> tuple[int, str, str]:
        file.write_text(vectors_text(given))
        return said(path, "--target", "c", "--for", "none", "--verify", "--vectors", str(file))

    program = image_for(image_of(load_arrangement(path))).program
    mine = drawn(program, "ringlet", sequences=2, steps=5)
    assert ask(mine) == (0, "Verified on cc: 10 ringlets, 0 differences.\n", "")
    first = mine.sequences[0]
    records = (tuple(v + (mine.fields[i] == "m.n") for i, v in enumerate(first.records[0])), *first.records[1:])
    code, out, err = ask(replace(mine, sequences=(replace(first, records=records),)))
    assert (code, err) == (1, "")
    assert out.startswith("On cc: sequence 1 differs in step 1: m.n is 5, expected 6")
    code, _, err = ask(replace(mine, program="x"))
    assert (code, "error[E509]: the vectors are of another program" in err) == (3, True)
    file.write_text("[]")
    code, _, err = said(path, "--target", "c", "--for", "none", "--verify", "--vectors", str(file))
    assert (code, "error[E522]" in err) == (3, True)


@pytest.mark.parametrize(
    ("table", "name", "value", "told"),
    [
        ("inputs", "go", 7, "has 7 for `go`, which is not in 0..1"),
        ("inputs", "go", 10**30, f"has {10**30} for `go`"),
        ("records", "shown", 10**30, f"has {10**30} for `shown`, which is not in -3..300"),
        ("records", "m.n", 4 + 2**64, "for `m.n`, which is not in 0..9"),
        ("fault", "", 3, "ends with fault 3, but the program has 2"),
        ("fault", "", 2**16, "ends with fault 65536"),
        ("sequences", "", 0, "the vectors have no step"),
        ("fields", "", 0, "have not the inputs and variables"),
    ],
)
def test_vectors_that_no_run_has_are_refused_before_the_image_runs(table, name, value, told, path, tmp_path):
    program = image_for(image_of(load_arrangement(path))).program
    vectors = drawn(program, "ringlet", sequences=2, steps=5)
    second = vectors.sequences[1]
    if table == "fault":
        second = replace(second, records=second.records[:-1], fault=value)
    elif name:
        rows = [list(row) for row in getattr(second, table)]
        rows[3][(vectors.inputs if table == "inputs" else vectors.fields).index(name)] = value
        second = replace(second, **{table: tuple(map(tuple, rows))})
        told = f"row 3 of `{table}` of `sequences[1]` {told}" if told.startswith("has") else told
    changed = replace(vectors, sequences=(vectors.sequences[0], second))
    if not name and table != "fault":
        changed = replace(vectors, **{table: () if table == "sequences" else vectors.fields[::-1]})
    (tmp_path / "v.json").write_text(vectors_text(changed))
    code, out, err = said(path, "--target", "c", "--for", "none", "--verify", "--vectors", str(tmp_path / "v.json"))
    assert (code, out) == (3, "")
    assert "error[E509]" in err
    assert told in err


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--for", "none", "--verify", "--cc", "no-such-cc"], 3, "error[E508]: `no-such-cc` is not installed"),
        (["--for", "none", "--verify", "--emulator", "no-such"], 3, "error[E508]: `no-such` is not installed"),
        (["--for", "none", "--verify", "--cc", "false"], 3, "error[E509]: false fails"),
        (["--for", "none", "--verify", "--cc", ""], 2, "--cc needs a command"),
        (["--for", "none", "--cc", "gcc", "-o", "x"], 2, "--cc needs --verify"),
        (["--for", "avr", "--verify", "--cc", "clang"], 2, "--cc needs another world than avr"),
        (["--for", "none"], 2, "-o/--output needs the name of a folder"),
        (["--for", "none", "--pins", "p.yaml", "-o", "x"], 2, "--pins needs --for avr"),
    ],
)
def test_what_is_missing_is_told(words, code, told, path):
    found, out, err = said(path, "--target", "c", *words)
    assert (found, out) == (code, "")
    assert told in err


@needs_gcc
def test_an_image_that_does_not_end_or_answer_is_told(small, monkeypatch):
    header, source = texts(small)
    vectors = drawn(small.program, "ringlet", sequences=1, steps=3)
    monkeypatch.setattr("llfsm_verify.extensions.c.verifying.run.SECONDS", 0.2)
    stuck = re.sub(r"(small_step\(.*\)\n\{)", r"\1 for (;;) { }", source)
    with pytest.raises(DiagnosticError, match=r"takes more than 0.2 seconds"):
        on_gcc("-w").run(small, (header, stuck), vectors)


LIARS = [
    ("echo ok 00000000; exit 1", "ok 00000000"),
    ("echo ok ffffffff", "ok ffffffff"),
    ("echo ok ff", "ok ff"),
    ("echo ok", "ok"),
    ("echo differs", "differs"),
    ("echo differs ffffff ffffff 0 0 0", "differs ffffff"),
    ("echo differs 00ffffff 00ffffff 00000000 00000000 00000001", "differs 00ffffff"),
    ("echo differs 00000000 00000001 00000063 00000000 00000001", "00000063"),
    ('"$1"; exit 3', "exit code 3"),
    ('"$1"; "$1"', "ok 0"),
    ("exit 0", "it gave no answer, exit code 0"),
    ("yes", "writes more than 16 MiB"),
]


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(("script", "told"), LIARS)
def test_an_emulator_that_does_something_else_is_not_believed(script, told, small, tmp_path):
    emulator = tmp_path / "emulator"
    emulator.write_text(f"#!/bin/sh\n{script}\n")
    emulator.chmod(0o755)
    vectors = drawn(small.program, "ringlet", sequences=1, steps=3)
    with pytest.raises(DiagnosticError) as caught:
        on_computer(Wanted("none", emulator=str(emulator))).run(small, texts(small), vectors)
    (found,) = caught.value.diagnostics
    assert found.code == "E509"
    assert told in found.message


@needs_gcc
@pytest.mark.slow
def test_words_of_the_commands_name_files_where_the_user_is(small, tmp_path, monkeypatch):
    for name, text in (("cc", 'exec gcc "$@"'), ("emu", 'test -f "$1" && exec "$2"')):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    (tmp_path / "include").mkdir()
    (tmp_path / "include" / "before.h").write_text("#define BEFORE 1\n")
    monkeypatch.chdir(tmp_path)
    wanted = Wanted("none", compiler="./cc -I include -include before.h", emulator="./emu cc")
    vectors = drawn(small.program, "ringlet", sequences=1, steps=3)
    ran = on_computer(wanted).run(small, texts(small), vectors)
    assert (ran.steps, ran.difference) == (3, None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cc", "emu", "include"]


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_all_that_was_started_and_leaves_no_folder(number, code, path, tmp_path):
    emulator, told, room = tmp_path / "emulator", tmp_path / "told", tmp_path / "room"
    room.mkdir()
    emulator.write_text(f"#!/bin/sh\nsleep 600 &\necho $$ $! > {told}.new; mv {told}.new {told}\nsleep 600\n")
    emulator.chmod(0o755)
    words = ("build", path, "--target", "c", "--for", "none", "--verify", "--emulator", str(emulator))
    process = subprocess.Popen(
        [sys.executable, "-m", "llfsm_verify", *words], env={**os.environ, "TMPDIR": str(room)},
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    while not told.exists():
        assert process.poll() is None
        time.sleep(0.02)
    assert any(room.iterdir())
    process.send_signal(number)
    assert process.wait() == code
    assert list(room.iterdir()) == []
    for pid in map(int, told.read_text().split()):
        while is_running(pid):  # it was sent SIGKILL, which cannot be ignored
            time.sleep(0.02)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("world", ["none", "posix"])
def test_a_path_that_is_not_utf_8_is_escaped(world, tmp_path):
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/d\xff")
    Path(folder).mkdir()
    file = Path(folder, os.fsdecode(b"f\xff.yaml"))
    file.write_text(SMALL)
    out = tmp_path / "out"
    code, _, err = said(str(file), "--target", "c", "--for", world, "-o", str(out), "--verify")
    assert (code, err) == (0, "")
    whole = re.sub(r"\n +\* ", " ", (out / "small.c").read_text(encoding="utf-8"))  # comments as one line
    assert "f?.yaml:13:66: A -> B when go */" in whole
    if world == "posix":
        assert r"/f\134udcff.yaml:13:32: " in (out / "small_loop.c").read_text() + (out / "small_main.c").read_text()
        program([out / name for name in ("small.c", "small_loop.c", "small_main.c")], out / "made")


def program(files: Sequence[Path], made: Path) -> None:
    words = ["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", *map(str, files), "-o", str(made)]
    subprocess.run(words, check=True)


def test_a_string_of_c_has_the_bytes_of_all_characters():
    assert quoted('a"\\b??/\n\x01é\U0001f600\udcff') == r'"a\042\134b?""?/\012\001\303\251\360\237\230\200\134udcff"'


def test_written_images_are_those_that_are_verified(small, tmp_path):
    write(small, tmp_path)
    assert (tmp_path / "small.c").read_text() == texts(small)[1]
