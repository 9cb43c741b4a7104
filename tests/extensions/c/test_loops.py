"""The loop for POSIX as a library: its call-backs, its times, and what was generated beside it."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import subprocess
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.runtime.live.control import BUCKETS, bucket_bounds
from llfsm_verify.runtime.live.run import percentiles
from llfsm_verify.runtime.recording.repeating import replay_recording
from llfsm_verify.targets.images import image_of
from tests.extensions.c.compiled import STRICT, needs_gcc
from tests.extensions.c.posix_programs import compiled, held, written
from tests.outside import needs

pytestmark = [needs_gcc, pytest.mark.slow]
HERE = Path(__file__).parent
EVERYTHING = "tests/extensions/c/everything.yaml"
LIFT = "models/lift/arrangement.yaml"
PERIOD = 10_000_000
FAKE = ("-Dclock_gettime=fake_gettime", "-Dclock_nanosleep=fake_nanosleep")


@pytest.fixture(scope="module")
def clocked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program whose clock the test has."""
    folder = tmp_path_factory.mktemp("clock")
    written(EVERYTHING, folder)
    (folder / "everything_main.c").unlink()
    shutil.copy(HERE / "clock.c", folder)
    return compiled(folder, *FAKE, "-fsanitize=undefined", "-fno-sanitize-recover=all")


class Times:
    """When cycles begin, as `runtime.live.text` says it."""

    def __init__(self) -> None:
        self.clock = self.base = 0
        self.started: int | None = None
        self.late: list[int] = []
        self.moved = 0

    def wait(self, cycle: int, oversleep: int) -> int:
        """Until a cycle begins: how late it is."""
        due = self.base + cycle * PERIOD
        begin = due if self.started is None else max(due, self.started + PERIOD // 2)
        if self.clock < begin:
            self.clock = begin + oversleep
        self.started, late = self.clock, self.clock - due
        self.late.append(late)
        if late >= PERIOD:
            self.base, self.moved = self.base + late, self.moved + late
        return late

    @property
    def overruns(self) -> int:
        return sum(late >= PERIOD for late in self.late)


def delays(random: Random, count: int) -> list[tuple[int, int]]:
    """How long a cycle works, and how long the sleep after it is too long."""
    works = (0, 5, 300_000, PERIOD // 2 + 7, PERIOD - 1, PERIOD, 3 * PERIOD)
    sleeps = (0, 1, 7, 8, 80_000, PERIOD - 1, PERIOD, 25_000_000)
    return [
        (random.choice(works) * (random.random() < 0.4), random.choice(sleeps) if random.random() < 0.4 else 60)
        for _ in range(count)
    ]


def ran(program: Path, given: list[tuple[int, int]], *words: str) -> list[str]:
    lines = "".join(f"{busy} {late}\n" for busy, late in given)
    done = subprocess.run([str(program), *words], input=lines, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.splitlines()


def test_cycles_begin_at_their_times_and_latenesses_are_counted(clocked: Path) -> None:
    for seed in range(4):
        given = delays(Random(seed), 300)
        *begins, end, buckets, shares = ran(clocked, given)
        times, wanted = Times(), []
        for cycle, (busy, late) in enumerate([(0, 0), *given]):
            times.clock += busy
            times.wait(cycle, late)
            wanted.append(times.clock)
        assert [int(line) for line in begins] == wanted
        assert end == f"stopped {times.overruns} {times.moved} {max(times.late)}"
        counts = [0] * BUCKETS
        for late in times.late:
            counts[next(i for i in range(BUCKETS) if late < bucket_bounds(i)[1])] += 1
        assert [int(n) for n in buckets.split()] == counts
        assert [int(n) for n in shares.split()] == [min(most, max(times.late)) for _, most in percentiles(counts)]
        assert times.overruns > 20


def test_a_late_cycle_ends_a_strict_run_before_it_begins(clocked: Path) -> None:
    given = [(0, 0), (0, PERIOD - 1), (PERIOD, 0), (0, 0), (3 * PERIOD, 0), (0, 0)]
    *begins, end, _, _ = ran(clocked, given, "strict")
    times, wanted = Times(), []
    for cycle, (busy, late) in enumerate([(0, 0), *given]):
        times.clock += busy
        if times.wait(cycle, late) >= PERIOD:
            break
        wanted.append(times.clock)
    assert [int(line) for line in begins] == wanted
    assert len(wanted) < len(given)
    assert end == f"late 1 {times.moved} {max(times.late)}"


def made(folder: Path, *words: str) -> str:
    done = subprocess.run(["make", "-C", str(folder), *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stderr


@needs("make")
def test_the_makefile_makes_the_program_and_the_library(tmp_path: Path) -> None:
    written(LIFT, tmp_path)
    assert made(tmp_path, "CFLAGS=-O0 -Werror", "lib") == ""
    assert not (tmp_path / "lift").exists()
    assert made(tmp_path, "CFLAGS=-O0 -Werror") == ""
    assert (tmp_path / "lift").exists()
    made(tmp_path, "clean")
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted(["", ".c", ".c", ".c", ".h", ".h", ".md"])


def test_a_program_in_c_embeds_the_loop(tmp_path: Path) -> None:
    written(LIFT, tmp_path)
    (tmp_path / "lift_main.c").unlink()
    shutil.copy(HERE / "embedding.c", tmp_path)
    program, recording = compiled(tmp_path), tmp_path / "r"
    done = subprocess.run([str(program), str(recording)], capture_output=True, text=True, check=True)
    step = image_for(image_of(load_arrangement(LIFT))).program
    native, rows = NativeProgram(step), []
    record = native.layout.first()
    for choices in held(step, [{"call[2]": int(cycle == 3)} for cycle in range(20)]):
        record = native.run(record, 99, stop_on_cycle=True, choices=choices).record
        rows.append(native.layout.decode(record))
    rows.append(rows[-1])  # the call at the end
    machines = {m.name: m for m in step.machines}
    state = next(slot.state for slot in step.slots if step.machines[slot.machine].name == "cabin")
    up = sum(row["motor"] == 1 for row in rows)
    rising = sum(machines["cabin"].states[row[state]] == "RISE" for row in rows)
    assert up > 9
    assert done.stdout == f"stopped 20 moved {up} rising {rising}\n"
    again = replay_recording(recording, None, load_arrangement)
    assert (again.same, again.frames) == (True, 22)
    done = subprocess.run([str(program), str(recording)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, f"{os.strerror(errno.EEXIST)}\n")


class Inputs(ctypes.Structure):
    _fields_ = [(f"call_{i}", ctypes.c_bool) for i in range(3)] + [
        ("floor", ctypes.c_uint8), ("level", ctypes.c_bool), ("shut", ctypes.c_bool),
    ]  # fmt: skip


class Outputs(ctypes.Structure):
    _fields_ = [("motor", ctypes.c_uint8), ("open", ctypes.c_bool)]


READ = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.POINTER(Inputs))
WRITE = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.POINTER(Outputs), ctypes.c_void_p)


class Calls(ctypes.Structure):
    _fields_ = [("context", ctypes.c_void_p), ("read", READ), ("write", WRITE), ("fault", ctypes.c_void_p),
                ("begin", ctypes.c_void_p)]  # fmt: skip


class Options(ctypes.Structure):
    _fields_ = [
        ("record", ctypes.c_char_p), ("stop", ctypes.POINTER(ctypes.c_int)), ("cycles", ctypes.c_uint64),
        ("at_once", ctypes.c_bool), ("strict", ctypes.c_bool),
    ]  # fmt: skip


class Report(ctypes.Structure):
    _fields_ = [
        ("ending", ctypes.c_int), ("detail", ctypes.c_int), ("why", ctypes.c_char_p), ("state", ctypes.c_void_p),
        ("cycles", ctypes.c_uint64), ("ringlets", ctypes.c_uint64), ("refused", ctypes.c_uint64),
        ("overruns", ctypes.c_uint64), ("moved", ctypes.c_int64), ("worst", ctypes.c_int64),
        ("late", ctypes.c_uint64 * BUCKETS), ("frames", ctypes.c_uint64), ("unrecorded", ctypes.c_int),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("library")
    written(LIFT, folder)
    command = ["gcc", *STRICT, "-O1", "-fPIC", "-shared", "lift.c", "lift_loop.c", "-o", "liblift.so"]
    subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "liblift.so"))


def test_python_calls_the_library(library: ctypes.CDLL, tmp_path: Path) -> None:
    """An input outside its range changes nothing, and is counted."""
    floors, motors = [0, 0, 0, 1, 7, 1, 2, 2], list[int]()

    def read(_: object, inputs: ctypes._Pointer[Inputs]) -> bool:
        inputs[0].floor = floors[len(motors)]
        inputs[0].call_2 = len(motors) == 1
        return True

    def write(_: object, outputs: ctypes._Pointer[Outputs], __: object) -> bool:
        motors.append(outputs[0].motor)
        return True

    report = Report()
    options = Options(str(tmp_path / "r").encode(), None, len(floors), True, False)
    assert library.lift_run(ctypes.byref(Calls(None, READ(read), WRITE(write), None, None)), ctypes.byref(options),
                            ctypes.byref(report)) == 0  # fmt: skip
    assert (report.cycles, report.refused, report.why, report.unrecorded) == (8, 1, b"stopped", 0)
    assert len(motors) == 9 and report.frames == 10
    again = replay_recording(tmp_path / "r", None, load_arrangement)
    assert (again.same, again.frames) == (True, 10)


def test_a_flag_stops_it(library: ctypes.CDLL) -> None:
    stop, report = ctypes.c_int(0), Report()

    def write(*_: object) -> bool:
        stop.value = 7
        return True

    options = Options(None, ctypes.pointer(stop), 0, False, False)
    calls = Calls(None, READ(), WRITE(write), None, None)
    assert library.lift_run(ctypes.byref(calls), ctypes.byref(options), ctypes.byref(report)) == 0
    assert (report.cycles, report.detail, report.why) == (1, 7, b"stopped")


FAULTY = """
name: faulty
cycle_ms: 1
whiteboard: {n: {type: 0..3, init: 2, role: output, safe: 0}}
machines:
  m: {inline: {machine: M, states: [{name: A, internal: "n = n + 1;", transitions: [{when: n == 0, to: A}]}]}}
schedule: [m]
"""
FAULT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p)


def test_safe_values_come_before_a_fault_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(FAULTY)
    written(str(tmp_path / "a.yaml"), tmp_path)
    command = ["gcc", *STRICT, "-O1", "-fPIC", "-shared", "faulty.c", "faulty_loop.c", "-o", "libfaulty.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    happened = list[int | str]()

    def write(_: object, outputs: ctypes._Pointer[ctypes.c_uint8], __: object) -> bool:
        happened.append(outputs[0])
        return True

    def fault(_: object, __: int, why: bytes) -> None:
        happened.append(why.decode().partition(" ")[2])

    taken = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint8), ctypes.c_void_p)(write)
    told, options, report = FAULT(fault), Options(None, None, 0, True, False), Report()
    calls = Calls(None, READ(), ctypes.cast(taken, WRITE), ctypes.cast(told, ctypes.c_void_p), None)
    library = ctypes.CDLL(str(tmp_path / "libfaulty.so"))
    assert library.faulty_run(ctypes.byref(calls), ctypes.byref(options), ctypes.byref(report)) == 0
    assert happened == [3, 0, "F001 value outside its range: n is declared 0..3"]
