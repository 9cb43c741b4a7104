"""Programs for POSIX: lines of JSON in and out, safe values at the end."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import resource
import signal
import subprocess
import time
from decimal import Decimal
from itertools import islice
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.target import C99, image_for
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.repeating import replay_recording
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted
from llfsm_verify.values import elements, text, value_text
from tests.extensions.c.compiled import STRICT, needs_gcc

pytestmark = [needs_gcc, pytest.mark.slow]
EVERYTHING = "tests/extensions/c/everything.yaml"
LIFT = "models/lift/arrangement.yaml"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A program of an arrangement, compiled once."""
    built = {}

    def build(path: str) -> str:
        if path not in built:
            folder = tmp_path_factory.mktemp("made")
            files = C99.make(image_of(load_arrangement(path)), Wanted("posix")).files
            for name, content in files.items():
                (folder / name).write_text(content)
            sources = [name for name in files if name.endswith(".c")]
            subprocess.run(["gcc", *STRICT, "-O1", *sources, "-o", "program"], cwd=folder, check=True)
            built[path] = str(folder / "program")
        return built[path]

    return build


def spoken(program: str, lines: list[str], *words: str) -> tuple[int, list[dict[str, object]], str]:
    """The exit code, the objects that a program prints for these lines, and what it refuses."""
    given = "".join(f"{line}\n" for line in lines)
    done = subprocess.run([program, *words], input=given, capture_output=True, text=True, check=False, timeout=60)
    return (
        done.returncode,
        [json.loads(line, parse_float=Decimal) for line in done.stdout.split("\n")[:-1]],
        done.stderr,
    )


@pytest.mark.parametrize("path", [EVERYTHING, LIFT])
def test_a_line_is_a_cycle_with_its_inputs_held(path, made):
    image = image_for(image_of(load_arrangement(path)))
    program, random = image.program, Random(4)
    native, held = NativeProgram(program), {**starting_values(program)}
    outputs = [v for v in program.vars if v.name in image.meaning.outputs]
    record, lines, wanted = native.layout.first(), [], []
    while len(wanted) < 200:
        asked = [c for c in program.choices if random.random() < (0.2 if c.name.startswith(OPERATOR) else 0.6)]
        changed = {c: random.randint(c.type.low, c.type.high) for c in asked}
        if any(c.name == "keys[2]" and value > 3 for c, value in changed.items()):
            continue  # which would end in a fault now and then
        given = [f'"{c.name}": {_json(value_text(c.type, c.labels, n), c.labels)}' for c, n in changed.items()]
        lines.append("{" + ", ".join(given) + "}")
        held |= {c.name: n for c, n in changed.items()}
        ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=held)
        assert ran.status == 0
        record = ran.record
        held |= {c.name: 0 for c in program.choices if c.name.startswith(OPERATOR) and c.type.boolean}
        values = native.layout.decode_record(record)
        shown = {name: text(value) for v in outputs for name, value in elements(v, values[v.name])}
        wanted.append({"cycle": str(len(wanted) + 1), **shown})
    code, found, refused = spoken(made(path), lines, "--lines")
    assert (code, refused) == (0, "")
    assert [{name: text(value) for name, value in each.items()} for each in found[:-1]] == wanted
    assert found[-1]["end"] == "stopped"


def _json(value: str, labels: tuple[str, ...]) -> str:
    return f'"{value}"' if labels else value


def test_a_fault_ends_it_with_safe_values(made):
    code, found, _ = spoken(made(EVERYTHING), ['{"far": 18446744073709551615, "code": 65535, "keys[2]": 4}'], "--lines")
    assert code == 1
    assert found[-1] == {
        "cycle": 0, "speed": Decimal("-0.500"), "shown": "BLUE",
        "end": f"{EVERYTHING}:69:69: F001 value outside its range: "
        "secret is declared 0..3",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("", "no JSON object"), ("[]", "no JSON object"), ("{", "no name of an input"), ("{go}", "no name of an input"),
        ('{"gone": true}', "no input of this name"), ('{"go" true}', "no colon after a name"),
        ('{"go": 1}', "no value of the input"), ('{"go": true', "no comma or brace after a value"),
        ('{"go": true,}', "no comma or brace after a value"), ('{"go": true} x', "something after the object"),
        ('{"level": 1.55}', "no value of the input"), ('{"level": 1.6}', "no value of the input"),
        ('{"level": -}', "no value of the input"), ('{"paint": "PINK"}', "no value of the input"),
        ('{"paint": 1}', "no value of the input"), ('{"far": -1}', "no value of the input"),
        ('{"far": 18446744073709551616}', "no value of the input"),
        ('{"go": true, "keys[0]": 9}', "no value of the input"),
        ('{"go": true, "go": true}', "an input twice"), ('{"go": true}\0garbage', "a byte of zero"),
        ("\0", "a byte of zero"), ('{"go": "' + "x" * 5000 + '"}', "more than 4095 characters"),
    ],
)  # fmt: skip
def test_a_wrong_line_is_refused_as_a_whole(line, why, made):
    code, found, refused = spoken(made(EVERYTHING), [line, "{}", "{}"], "--lines")
    assert (code, refused) == (0, f"refused: {why}\n")
    assert len(found) == 4
    assert found[2]["shown"] == "GREEN"


@pytest.mark.parametrize("name", ["😀", "\x85\x01\x1b[2J", "\u202e\u2066é", 'a"b\\', "x???'", "\udcff"])
def test_a_fault_is_told_whatever_its_file_is_called(name, made, tmp_path):
    """C of any name compiles, under `-Wbidi-chars` too, and has no character that a reader does not see."""
    states = '[{name: A, internal: "n = k;", transitions: [{when: false, to: A}]}]'
    path = tmp_path / f"{name}.yaml"
    path.write_text(
        "cycle_ms: 1\nwhiteboard: {n: {type: 0..3, init: 0}, k: {type: 0..9, init: 0, role: input}}\n"
        f"machines: {{m: {{inline: {{machine: M, states: {states}}}}}}}\nschedule: [m]\n"
    )
    program = made(str(path))
    code, found, _ = spoken(program, ['{"k": 7}'], "--lines")
    told = name.replace("\udcff", r"\udcff")
    assert (code, str(found[-1]["end"]).startswith(f"{tmp_path}/{told}.yaml:")) == (1, True)
    for source in Path(program).parent.glob("*.[ch]"):
        assert not re.search("[^\n -~\xa0-\u2010\u2070-\U0010ffff]", source.read_text())


def test_a_program_without_inputs_or_outputs_compiles(made, tmp_path):
    states = "[{name: A, transitions: [{when: true, to: B}]}, {name: B}]"
    (tmp_path / "a.yaml").write_text(
        f"cycle_ms: 1\nmachines: {{m: {{inline: {{machine: M, states: {states}}}}}}}\nschedule: [m]\n"
    )
    program = made(str(tmp_path / "a.yaml"))
    code, found, refused = spoken(program, ["{}"] * 9, "--lines")
    assert (code, refused, found[-1]) == (0, "", {"cycle": 2, "end": "finished"})


def test_wrong_options_say_which_there_are(made):
    assert spoken(made(LIFT), [], "--fast")[0] == 2
    assert "--lines" in spoken(made(LIFT), [], "--fast")[2]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_safe_values(number, made):
    with subprocess.Popen([made(EVERYTHING)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["cycle"] == 1
        process.send_signal(number)
        last = json.loads(process.stdout.read().splitlines()[-1], parse_float=Decimal)
    assert process.returncode == 0
    assert (last["speed"], last["shown"], last["end"]) == (Decimal("-0.500"), "BLUE", "stopped")


COUNTING = """
name: counting
cycle_ms: 1
whiteboard: {n: {type: 0..999, init: 0, role: output, safe: 999}}
machines:
  m:
    inline: {machine: M, states: [{name: A, internal: "n = (n + 1) % 500;", transitions: [{when: n == 999, to: A}]}]}
schedule: [m]
"""


@pytest.fixture
def counting(made, tmp_path):
    (tmp_path / "a.yaml").write_text(COUNTING)
    return made(str(tmp_path / "a.yaml"))


def full() -> tuple[int, int, bytes]:
    """A pipe that is full, and what it is full of."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    size = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            size += os.write(writer, b"." * 4096)
    os.set_blocking(writer, True)
    return reader, writer, b"." * size


def wait_for_frames(record: Path, process: subprocess.Popen[bytes]) -> None:
    """Until a program has recorded some."""
    for _ in range(6000):
        with contextlib.suppress(DiagnosticError), Recording(record) as recording:
            if sum(1 for _ in islice(recording, 8)) == 8:
                return
        time.sleep(0.01)
    process.kill()
    pytest.fail("its cycles do not go on")


def test_a_signal_ends_it_where_standard_output_is_full(counting, tmp_path):
    """Cycles go on meanwhile, and are recorded."""
    reader, writer, dots = full()
    command = [counting, "--record", str(tmp_path / "r")]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=writer, stderr=writer) as process:
        os.close(writer)
        wait_for_frames(tmp_path / "r", process)
        process.terminate()
        assert process.wait(60) == 1
    assert os.read(reader, 1 << 20) == dots
    os.close(reader)
    assert replay_recording(tmp_path / "r", str(tmp_path / "a.yaml"), load_arrangement).same


def test_outputs_that_find_no_room_are_left_out_and_lines_stay_whole(counting, tmp_path):
    reader, writer, dots = full()
    command = [counting, "--record", str(tmp_path / "r")]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=writer, stderr=subprocess.PIPE) as process:
        os.close(writer)
        wait_for_frames(tmp_path / "r", process)
        assert os.read(reader, len(dots)) == dots
        with os.fdopen(reader, "rb") as lines:
            found = [json.loads(lines.readline()), json.loads(lines.readline())]
            process.terminate()
            found += [json.loads(line) for line in lines.read().splitlines()]
        assert process.wait(60) == 0
    assert found[0]["cycle"] == 1  # the first line that found no room waited for some
    assert found[1]["cycle"] > 7
    assert all(each["n"] == each["cycle"] % 500 for each in found[:-1])
    assert (found[-1]["n"], found[-1]["end"]) == (999, "stopped")


def test_a_reader_that_ignores_the_signal_of_all_gets_the_safe_values(counting):
    """As the README of the lift as a daemon has it."""
    command = ["sh", "-c", '"$0" < /dev/null | (trap "" TERM; exec cat)', counting]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGTERM)
        last = json.loads(process.stdout.read().splitlines()[-1])
    assert (last["n"], last["end"]) == (999, "stopped")


def test_it_ends_where_nobody_reads_on(made):
    command = [made(EVERYTHING), "--lines"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdout.close()
        process.stdin.write("{}\n")
        process.stdin.flush()
        assert process.wait(60) == 0


def test_outputs_that_cannot_be_written_end_it_and_are_told(made, tmp_path):
    """The largest size of a file stands for a full disk."""

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200, 200))

    with (tmp_path / "out").open("w") as out:
        done = subprocess.run(
            [made(EVERYTHING), "--lines"], input="{}\n" * 50, stdout=out, stderr=subprocess.PIPE, text=True,
            check=False, preexec_fn=limited,
        )  # fmt: skip
    told = f"standard output cannot be written: {os.strerror(errno.EFBIG)}\n"
    assert (done.returncode, done.stderr) == (1, told)
    assert (tmp_path / "out").stat().st_size == 200


def test_a_cycle_takes_at_most_so_many_bytes(made, tmp_path):
    """Who writes much delays no cycle: what is beyond waits for the next ones."""
    given = tmp_path / "lines"
    given.write_text("[]\n" * 20_000)
    told = tmp_path / "told"  # a pipe that nobody reads in time would lose some
    with given.open() as lines, told.open("w") as errors:
        subprocess.run([made(EVERYTHING), "--cycles", "3"], stdin=lines, stderr=errors, stdout=errors, check=False)
        assert os.lseek(lines.fileno(), 0, os.SEEK_CUR) == 3 * 4096
    assert told.read_text().count("refused: no JSON object\n") == 3 * 4096 // 3


def test_a_late_cycle_ends_it_where_that_is_asked_for(made):
    with subprocess.Popen(
        [made(EVERYTHING), "--strict"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as p:
        assert p.stdout is not None
        p.stdout.readline()
        p.send_signal(signal.SIGSTOP)
        time.sleep(0.05)  # the cycle takes 10 ms
        p.send_signal(signal.SIGCONT)
        last = json.loads(p.stdout.read().splitlines()[-1])
    assert (p.returncode, last["end"], last["shown"]) == (1, "late", "BLUE")
