"""Recordings of programs in C: those of `llfsm run`, but for the times in them."""

from __future__ import annotations

import errno
import json
import os
import re
import resource
import shutil
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.layout import BitField, Layout
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.c import loop
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.deciding.recordings import check
from llfsm_verify.runtime.live.frame import FrameLayout
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.origin import arrangement_of
from llfsm_verify.runtime.recording.repeating import Repeated, replay_recording
from llfsm_verify.runtime.recording.replay import CLOCKED
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.extensions.c.compiled import needs_gcc
from tests.extensions.c.posix_programs import Cycle, compiled, drawn, lines_of, recorded_by_a_run, written
from tests.extensions.c.test_arrangements import adapted
from tests.outside import program
from tests.quick import each, many, spread

pytestmark = [needs_gcc, pytest.mark.slow]
EVERYTHING = "tests/extensions/c/everything.yaml"
LIFT = "models/lift/arrangement.yaml"
SAFE = ("-fsanitize=undefined", "-fno-sanitize-recover=all")
KINDS = ("stopped", "fault", "ended", "events", "fired", "choices")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The sources and the program of each of two arrangements."""
    found = {}
    for path in (EVERYTHING, LIFT):
        folder = tmp_path_factory.mktemp("made")
        written(path, folder)
        compiled(folder, *SAFE)
        found[path] = folder
    return found


@pytest.fixture(scope="module")
def fixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program with inputs that never change."""
    folder = tmp_path_factory.mktemp("fixed")
    (folder / "a.yaml").write_text(NEVER)
    written(str(folder / "a.yaml"), folder)
    return compiled(folder, *SAFE)


@pytest.fixture(scope="module")
def made_to_embed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program of a user's own around the library; it prints."""
    folder = tmp_path_factory.mktemp("embedded")
    written(LIFT, folder)
    (folder / "lift_main.c").unlink()
    shutil.copy(Path(__file__).parent / "embedding.c", folder)
    return compiled(folder)


def program_of(path: str) -> Program:
    return image_for(image_of(load_arrangement(path))).program


def run(
    built: Path, recording: Path, lines: list[str], *words: str, before: Sequence[str] = ()
) -> subprocess.CompletedProcess[str]:
    """Let it run a cycle a line, and record that. `before`: the command that runs it."""
    given = "".join(f"{line}\n" for line in lines)
    command = [*before, str(built), "--lines", "--record", str(recording), *words]
    return subprocess.run(command, input=given, capture_output=True, text=True, check=False, timeout=60)


def replayed(path: Path, instead: str | None = None) -> Repeated:
    return replay_recording(path, instead, load_arrangement)


def frames(path: Path) -> list[list[int]]:
    """The frames of a recording, without times."""
    with Recording(path) as recording:
        found = [[w for i, w in enumerate(turn.frame) if i not in CLOCKED] for turn in recording]
        assert (recording.damaged, recording.lost) == (None, None)
    return found


def compare(path: str, built: Path, cycles: list[Cycle], tally: Counter[str], folder: Path) -> None:
    """A recording of a program and one of `llfsm run`, with the same inputs."""
    program, mine, other = program_of(path), folder / "mine", folder / "other"
    for old in (mine, other):
        old.unlink(missing_ok=True)
    done = run(built, mine, lines_of(program, cycles))
    again = replayed(mine)
    assert again.same, again.sentence
    assert recorded_by_a_run(path, cycles, other) == again.ending
    assert frames(mine) == frames(other)
    assert f"({again.frames} frames)" in done.stderr
    tally[again.ending] += 1
    with Recording(mine) as recording, Recording(other) as wanted:
        assert {**recording.header, "build": 0} == {**wanted.header, "build": 0}
        last = list(recording)[-1].frame
    layout = FrameLayout.of(program, Layout.of(program))
    for kind, begin, end in (("fired", layout.fired, layout.choices), ("choices", layout.choices, layout.events),
                             ("events", layout.events, layout.monitors)):  # fmt: skip
        tally[kind] += any(last[begin:end])


@pytest.mark.long
def test_random_arrangements_record_what_a_run_records(tmp_path: Path) -> None:
    tally = Counter[str]()

    def one(document: Document, seed: int) -> None:
        path = tmp_path / "a.yaml"
        path.write_text(json.dumps(adapted(document, unloads=seed % 2 == 0)))
        try:
            arrangement = image_of(load_arrangement(str(path)))
        except DiagnosticError:
            return
        for old in tmp_path.glob("*.[ch]"):
            old.unlink()
        written(str(path), tmp_path)
        cycles = drawn(image_for(arrangement).program, Random(seed), 60)
        compare(str(path), compiled(tmp_path, "-O0", *SAFE), cycles, tally, tmp_path)

    amount = settings(max_examples=many(600), deadline=None, database=None, suppress_health_check=list(HealthCheck))
    spread(one, amount, arrangements(), st.integers(0, 1 << 16), size=5, until=each(tally, KINDS))


@pytest.mark.parametrize("path", [EVERYTHING, LIFT])
def test_it_records_what_a_run_records(path: str, folders: dict[str, Path], tmp_path: Path) -> None:
    tally = Counter[str]()
    program = program_of(path)
    for seed in range(6):
        compare(path, folders[path] / "program", drawn(program, Random(seed), 150), tally, tmp_path)
    assert tally["fired"] and (path == LIFT or (tally["events"] and tally["fault"])), tally


@pytest.mark.parametrize("machine", ["arm", "aarch64", "riscv64"])
def test_other_machines_record_the_same(machine: str, folders: dict[str, Path], tmp_path: Path) -> None:
    compiler, emulator = program(f"{machine}-gcc"), program(f"qemu-{machine}")
    built = compiled(folders[EVERYTHING], "-static", compiler=compiler, name=machine)
    step, paths = program_of(EVERYTHING), [tmp_path / machine, tmp_path / "here"]
    lines = lines_of(step, drawn(step, Random(5), 200))
    run(built, paths[0], lines, before=[emulator])
    run(folders[EVERYTHING] / "program", paths[1], lines)
    assert replayed(paths[0]).same
    assert frames(paths[0]) == frames(paths[1])


@pytest.mark.parametrize("mistake", ["shift", "low", "word", "turned"])
def test_a_variable_that_is_packed_wrongly_is_found(
    mistake: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    packed = loop._packed

    def wrong(field: BitField, path: str) -> Iterator[str]:
        if mistake == "word":
            field = replace(field, word=0)
        if mistake == "shift":
            field = replace(field, shift=field.shift + (field.name == "hash" or field.bits < 3 < field.shift < 60))
        if mistake == "low":
            field = replace(field, low=0)
        if mistake == "turned" and field.length is not None:
            path = path.replace("pair_x", "pair_f")
        yield from packed(field, path)

    monkeypatch.setattr(loop, "_packed", wrong)
    written(EVERYTHING, tmp_path)
    step, path = program_of(EVERYTHING), tmp_path / "r"
    run(compiled(tmp_path, "-O0"), path, lines_of(step, drawn(step, Random(5), 200)))
    assert "of the record is" in replayed(path).sentence


def test_properties_are_decided_as_on_a_recording_of_a_run(folders: dict[str, Path], tmp_path: Path) -> None:
    program, mine, other = program_of(LIFT), tmp_path / "mine", tmp_path / "other"
    cycles = drawn(program, Random(3), 200)
    run(folders[LIFT] / "program", mine, lines_of(program, cycles))
    recorded_by_a_run(LIFT, cycles, other)
    text = "moves: G (motor != STOP -> shut)\nopens: F open\nrests: G motor == STOP\nfar: G F open\n"
    properties = parse_properties([Source("p.ltl", text)], "llfsm")
    decided = []
    for path in (mine, other):
        with Recording(path) as recording:
            decided.append(check(arrangement_of(recording, load_arrangement), properties, recording))
    assert decided[0] == decided[1]
    assert {one.verdict for one in decided[0]} == {"violated", "satisfied", "undecided"}


def test_it_says_which_build_wrote_it(folders: dict[str, Path], tmp_path: Path) -> None:
    run(folders[LIFT] / "program", tmp_path / "r", ["{}"])
    header = (folders[LIFT] / "lift.h").read_text()
    layout = re.search(r"LAYOUT UINT32_C\((0x\w+)\)", header)
    assert layout is not None
    with Recording(tmp_path / "r") as recording:
        assert recording.notes == (
            f"a program of `llfsm build --target c --for posix` wrote it, with layout {layout[1]}",
        )


NEVER = """
name: fixed
cycle_ms: 10
types: {Mode: [SLOW, FAST]}
whiteboard:
  mode: {type: Mode, role: input, changes: never}
  limit: {type: {decimal: 0.1, range: -0.5..0.5}, role: input, changes: never}
  gains: {type: {array: uint64, size: 2}, role: input, changes: never}
  on: {type: bool, role: input, changes: never}
  go: {type: bool, role: input}
  out: {type: uint64, role: output}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          stays: true
          internal: if (go && on && mode == FAST && limit == -0.4) out = gains[1];
schedule: [m]
"""


def test_inputs_that_never_change_are_in_its_header(fixed: Path, tmp_path: Path) -> None:
    path, mine, other, most = str(fixed.parent / "a.yaml"), tmp_path / "mine", tmp_path / "other", (1 << 64) - 1
    given = {"mode": "FAST", "limit": "-0.4", "gains[1]": str(most), "on": "true"}
    words = [word for name, value in given.items() for word in ("--set", f"{name}={value}")]
    done = run(fixed, mine, ['{"go": true}', "{}"], *words)
    assert json.loads(done.stdout.splitlines()[0]) == {"cycle": 1, "out": most}
    recorded_by_a_run(path, [{"go": 1}, {}], other, given)
    assert replayed(mine).same
    assert frames(mine) == frames(other)
    with Recording(mine) as recording, Recording(other) as wanted:
        assert {**recording.header, "build": 0} == {**wanted.header, "build": 0}
        assert recording.header["free"] == {"mode": 1, "limit": -4, "gains[0]": 0, "gains[1]": most, "on": 1}


@pytest.mark.parametrize(
    ("word", "why"),
    [
        ("go=true", "no input of this name that never changes and has no `init`"),
        ("mode", "no input of this name that never changes and has no `init`"),
        ("mode=MEDIUM", "no value of the input"), ("limit=0.6", "no value of the input"),
        ("limit=0.11", "no value of the input"), ("on=true1", "no value of the input"),
        ("on=", "no value of the input"), ("gains[0]=18446744073709551616", "no value of the input"),
    ],
)  # fmt: skip
def test_a_wrong_value_of_one_is_told_before_it_runs(word: str, why: str, fixed: Path) -> None:
    done = subprocess.run([fixed, "--set", word, "--lines"], capture_output=True, text=True, check=False, input="{}\n")
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"--set {word}: {why}\n")


def test_mistakes_are_told(folders: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "r"
    run(folders[LIFT] / "program", path, ['{"call[1]": true}', '{"level": false}', "{}", "{}"])
    data = path.read_bytes()
    assert replayed(path).sentence == "6 frames, the same bit for bit, and then stopped"

    for at in range(len(data) - 60, len(data), 7):
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        assert replayed(path).damaged is not None
    path.write_bytes(data[:-9])
    assert replayed(path).damaged == "the end of the file is missing"
    path.write_bytes(data.replace(b'"layout"', b'"layoux"'))
    with pytest.raises(DiagnosticError, match="its header was changed"):
        replayed(path)
    path.write_bytes(data)
    assert "differs" in replayed(path, "models/lift/faulty_hurry.yaml").sentence


def test_another_image_is_found(folders: dict[str, Path], tmp_path: Path) -> None:
    """Each assignment to an output that becomes another one."""
    source = (folders[LIFT] / "lift.c").read_text()
    body = source[: source.index("void lift_init(")]
    program, found = program_of(LIFT), Counter[str]()
    lines = lines_of(program, drawn(program, Random(8), 300))
    for number, place in enumerate(re.finditer(r"outputs\.(\w+) = (\w+);", body)):
        other = {"true": "false", "false": "true"}.get(place[2], "(uint8_t)0")
        folder = tmp_path / str(number)
        folder.mkdir()
        for name in ("lift.h", "lift_loop.h", "lift_loop.c", "lift_main.c"):
            (folder / name).write_text((folders[LIFT] / name).read_text())
        (folder / "lift.c").write_text(source[: place.start(2)] + other + source[place.end(2) :])
        run(compiled(folder, "-O0"), folder / "r", lines)
        found["differs" if replayed(folder / "r").differs else place[0]] += 1
    assert found["differs"] > 3 and set(found) <= {"differs"} | {t for t in found if t.endswith("STOP;")}, found


def test_a_file_that_is_there_stays_as_it_is(folders: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "r"
    path.write_text("mine")
    done = run(folders[LIFT] / "program", path, ["{}"])
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr == f"{path}: a file is there already; name a new one\n"
    assert path.read_text() == "mine"
    done = run(folders[LIFT] / "program", tmp_path / "none" / "r", ["{}"])
    assert (done.returncode, done.stderr) == (3, f"{tmp_path}/none/r: No such file or directory\n")
    assert run(folders[LIFT] / "program", tmp_path / "s", [], "--record").returncode == 2
    assert not (tmp_path / "s").exists()


def test_a_program_that_is_killed_leaves_its_complete_cycles(folders: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "r"
    command = [str(folders[LIFT] / "program"), "--lines", "--record", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        for _ in range(20):
            process.stdin.write('{"call[2]": true}\n')
            process.stdin.flush()
            process.stdout.readline()
        assert replayed(path).lost == "the run goes on"
        process.kill()
    again = replayed(path)
    assert again.same and again.frames in (20, 21)
    assert again.sentence.endswith("and then nothing: the process was killed")


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"])
def test_closed_standard_files_leave_a_recording_whole(
    closed: str, folders: dict[str, Path], tmp_path: Path, made_to_embed: Path
) -> None:
    path = tmp_path / "r"
    command = ["sh", "-c", f'exec "$0" "$@" {closed}']
    words = [*command, folders[EVERYTHING] / "program", "--cycles", "5", "--record", path]
    done = subprocess.run(words, input="[]\n", capture_output=True, text=True, check=True)
    assert done.stderr.count("refused") == (closed == ">&-")
    assert replayed(path).sentence == "7 frames, the same bit for bit, and then stopped"
    if closed == ">&-":
        path.unlink()
        subprocess.run([*command, made_to_embed, path], check=True)
        assert (replayed(path).same, replayed(path).frames) == (True, 22)


def test_a_full_disk_ends_the_recording_and_not_the_run(tmp_path: Path) -> None:
    """The largest size of a file stands for the disk."""
    sources = tmp_path / "sources"
    sources.mkdir()
    written(LIFT, sources)
    text = (sources / "lift_loop.c").read_text()
    (sources / "lift_loop.c").write_text(text.replace("UINT64_C(1048576)", "UINT64_C(65536)"))
    program, path = compiled(sources), tmp_path / "r"
    size = 3 * 65536 + 100

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    lines = "".join(f'{{"call[{i % 3}]": true}}\n' for i in range(15_000))
    command = [str(program), "--lines", "--record", str(path)]
    done = subprocess.run(
        command, input=lines, capture_output=True, text=True, check=False, timeout=60, preexec_fn=limited
    )
    assert done.returncode == 1
    again = replayed(path)
    assert again.same and again.lost == f"the file could not grow ({os.strerror(errno.EFBIG)})"
    assert f"the recording ended before the run, after {again.frames} frames: {os.strerror(errno.EFBIG)}" in done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["cycle"] == 15_000 > again.frames > 5_000


def test_a_long_run_takes_no_more_memory(folders: dict[str, Path], tmp_path: Path) -> None:
    """It may have less than it records."""
    program, path, size = compiled(folders[LIFT], name="plain"), tmp_path / "r", 1 << 20

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_DATA, (size, size))

    lines = "".join(f'{{"call[{i % 3}]": true, "floor": {i % 2}}}\n' for i in range(80_000))
    command = [str(program), "--lines", "--record", str(path)]
    done = subprocess.run(
        command, input=lines, capture_output=True, text=True, check=False, timeout=60, preexec_fn=limited
    )
    assert (done.returncode, done.stderr) == (0, f"recorded: {path} (80002 frames)\n")
    assert path.stat().st_size > size


def test_a_signal_ends_it_with_a_last_frame(folders: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "r"
    command = [str(folders[EVERYTHING] / "program"), "--record", str(path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        said = process.stderr.read().splitlines()
    again = replayed(path)
    assert again.same and again.ending == "stopped"
    report = json.loads(said[0])
    assert report["cycles"] == again.frames - 2 and report["ringlets"] >= report["cycles"]
    assert 0 <= report["late_ns"]["50 %"] <= report["late_ns"]["99.9 %"] <= report["late_ns"]["worst"]
    assert said[1] == f"recorded: {path} ({again.frames} frames)"
