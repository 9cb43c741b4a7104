"""The loop in machine code against the reference, its recordings performed again, and what others see of it."""

from __future__ import annotations

import ctypes
import errno
import os
import time
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify import kept
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.backends.native import machine_code
from llfsm_verify.backends.native.executor import OVERFLOW
from llfsm_verify.backends.native.machine_code import MachineCode
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.monitoring.properties import monitor_properties
from llfsm_verify.runtime.live import control, generations
from llfsm_verify.runtime.live.frame import (
    COUNTED,
    CYCLE,
    DETAIL,
    ENDING,
    ENDINGS,
    LATENESS,
    MOVED,
    NUMBER,
    PROCESS,
    STEPS,
)  # fmt: skip
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.plan import drawn_choices, runnable, script_of, starting_values
from llfsm_verify.runtime.live.run import Run, percentiles
from llfsm_verify.runtime.recording.file import Prescription, Recorder, Turn
from llfsm_verify.runtime.recording.replay import CLOCKED, Differs, replay
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.quick import AtLeast, examples, many, spread
from tests.runtime.live.runs import code_of, recorded, turns_of

LIGHTS = "models/traffic_lights/arrangement.yaml"
LAMP = {
    "name": "lamp",
    "cycle_ms": 10,
    "whiteboard": {"on": {"type": "bool", "role": "input"}, "n": {"type": "0..3", "init": 0, "role": "output"}},
    "machines": {
        "m": {
            "inline": {
                "machine": "M",
                "states": [
                    {"name": "OFF", "transitions": [{"when": "on", "to": "ON"}]},
                    {"name": "ON", "on_entry": "n = n + 1;", "transitions": [{"when": "!on", "to": "OFF"}]},
                ],
            }
        }
    },
    "schedule": ["m"],
}


def follow(code: LiveCode, turns: list[Turn], tally: Counter[str]) -> None:
    """Perform what a recording says with the reference interpreter, ringlet by ringlet, and compare frame by frame."""
    program, layout, frames = code.program, code.layout, code.frames
    interpreter = Interpreter(program)
    names = [choice.name for choice in program.choices]
    first = layout.first()
    values, outputs = layout.decode(first), layout.decode_outputs(first)
    fired = [0] * len(program.slots)
    counts = [0] * len(COUNTED)
    steps = 0
    for turn in turns[1:]:
        frame = turn.frame
        given = dict(zip(names, frame[frames.choices : frames.events], strict=True))
        if not frame[ENDING]:
            fired = [0] * len(program.slots)
        while steps < frame[STEPS] or ENDINGS[frame[ENDING]] in ("fault", "overflow"):
            done = interpreter.step(values, outputs, frame[PROCESS], lambda choice, given=given: given[choice.name])
            if done.fault is not None or done.overflow:
                assert frame[DETAIL] == (1 + done.fault if done.fault is not None else OVERFLOW), frame
                tally["failures"] += 1
                return
            values, outputs = done.values, done.outputs
            steps += 1
            ran, transition = outputs[program.ran], outputs[program.fired]
            assert isinstance(ran, int) and isinstance(transition, int)
            fired[ran - 1] = transition
            for kind, _, _ in done.events:
                if kind in COUNTED:
                    counts[COUNTED.index(kind)] += 1
        assert frame[STEPS] == steps
        record = layout.encode(values) + layout.encode_outputs(outputs)
        assert frames.record_of(frame) == record
        assert list(frame[frames.fired : frames.choices]) == fired
        assert list(frame[frames.events : frames.monitors]) == counts
        tally["frames"] += 1
        tally["events"] = max(tally["events"], sum(counts))


def agree(folder: Path, count: int, turns: int) -> None:
    tally: Counter[str] = Counter()

    def check(document: Document, seed: int) -> None:
        code = code_of(build_arrangement(document))
        _, found = recorded(code, folder / "r", turns, seed)
        follow(code, found, tally)
        assert list(replay(code, found)) == found
        tally["several processes"] += len(code.program.processes) > 1

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    seeds = st.integers(1, 1 << 40)
    least = {"frames": count, "failures": 1, "events": 1}
    spread(check, amount, arrangements(), seeds, size=10, until=AtLeast(tally, least))


@pytest.mark.long
def test_the_loop_agrees_with_the_reference(tmp_path: Path) -> None:
    agree(tmp_path, examples(12), 12)


@pytest.mark.long
def test_the_loop_agrees_with_the_reference_on_many(tmp_path: Path) -> None:
    agree(tmp_path, many(400), 40)


# ---------------------------------------------------------------- turns and choices


@pytest.mark.slow
def test_the_machine_code_of_a_run_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.FOLDER, str(tmp_path))
    program = lower(build_arrangement(LAMP), (), keep_all_bits=True)
    made = LiveCode(program)
    monkeypatch.setattr(machine_code, "_compiled", lambda *_: pytest.fail("compiled again"))
    records = []
    for code in (made, LiveCode(program)):
        loop = Loop(code)
        loop.begin(0)
        loop.go(4)
        records.append((loop.steps, loop.record))
    assert records[0] == records[1]


def test_several_processes_take_turns_by_cycles(tmp_path: Path) -> None:
    machines = dict.fromkeys("abc", LAMP["machines"]["m"])
    board = {"on": {"type": "bool", "role": "input"}, "n": {"type": "uint8"}}
    document = {**LAMP, "whiteboard": board, "machines": machines, "processes": {"p": ["a", "b"], "q": ["c"]}}
    del document["schedule"]
    code = code_of(build_arrangement(document))
    loop, found = recorded(code, tmp_path / "r", 50, 7)
    assert len(code.program.processes) == 2 and list(replay(code, found)) == found
    order = [turn.frame[PROCESS] for turn in found[1:-1]]
    count = len(code.program.processes)
    assert order == [i % count for i in range(50)]
    assert [turn.frame[CYCLE] for turn in found[1:-1]] == [i // count for i in range(50)]
    assert [turn.frame[NUMBER] for turn in found] == list(range(1, loop.number + 1))


@pytest.mark.slow
def test_choices_within_a_turn(tmp_path: Path) -> None:
    """What a trace prescribes for each ringlet is in the recording, and performed again."""
    lights = load_arrangement(LIGHTS)
    code = code_of(lights)
    numbers = {choice.name: i for i, choice in enumerate(code.program.choices)}
    loop = Loop(code)
    recorder = Recorder(tmp_path / "r", {}, loop)
    script = [Prescribed(step, numbers["car"], step % 2) for step in range(30)]
    loop.prescribe(script)
    loop.begin(0)
    assert loop.go(10) == control.DONE
    loop.end("stopped")
    recorder.close()
    found = turns_of(tmp_path / "r")
    assert [len(turn.prescribed) for turn in found[1:-1]] == [2] * 10
    assert list(replay(code, found)) == found
    assert [Prescribed(s, numbers["car"], s % 2) for s in range(30)] == script_of(
        code.program, [{"car": s % 2, "gone": 1} for s in range(30)]
    )


@pytest.mark.slow
def test_the_readings_of_one_input_are_the_same_in_a_turn() -> None:
    """With `snapshot: none`, each read of an input is a choice of its own."""
    document = {**LAMP, "profile": {"snapshot": "none"}}
    code = code_of(build_arrangement(document))
    reads = [i for i, choice in enumerate(code.program.choices) if choice.input == "on"]
    assert len(reads) > 1
    loop = Loop(code, seed=3, drawn=drawn_choices(code.program, {}))
    seen = set()
    loop.begin(0)
    for _ in range(50):
        assert loop.go(1) in (control.DONE, control.FAILED)
        values = {loop.frame[code.frames.choices + i] for i in reads}
        assert len(values) == 1
        seen |= values
    assert seen == {0, 1}


@pytest.mark.slow
def test_held_choices_are_not_drawn() -> None:
    code = code_of(load_arrangement(LIGHTS))
    assert drawn_choices(code.program, {"car": 1}) == []
    loop = Loop(code, held={"car": 1})
    loop.begin(0)
    loop.go(5)
    assert loop.frame[code.frames.choices] == 1
    with pytest.raises(ValueError, match="outside"):
        Loop(code, held={"car": 2})


def test_a_model_runs_in_simulation_only() -> None:
    crossing = load_arrangement("models/level_crossing/arrangement.yaml")
    assert crossing.plants
    assert runnable(crossing, simulated=False).plants == ()
    assert runnable(crossing, simulated=True).plants is crossing.plants
    driven = {w.variable.name for w in crossing.whiteboard if w.driven}
    assert driven
    posted = {choice.input for choice in lower(runnable(crossing, simulated=False)).choices}
    assert driven <= posted, "the inputs that others post take its place"
    region = load_arrangement("models/komodo_region/arrangement.yaml")
    with pytest.raises(DiagnosticError, match="E483"):
        runnable(region, simulated=False)


@pytest.mark.slow
@pytest.mark.parametrize("observe", ["ringlet", "cycle"])
def test_monitors_in_the_loop_read_what_those_beside_a_simulation_read(observe: str) -> None:
    """The states of the monitors stand in the frames; the loop stops, if it is asked to, where one becomes settled."""
    lights = replace(load_arrangement("models/traffic_lights/faulty.yaml"), observe=observe)
    lines = parse_properties([Source("p", "both: G !(ns@GREEN && ew@GREEN)\nsoon: F ew@AMBER\n")])
    bound = bind(lights, lines)
    program = lower(lights, bound.atoms, keep_all_bits=True)
    monitors = {line.name: monitor_properties(line).monitor for line in lines}
    code = LiveCode(program, monitors)
    held = starting_values(program) | {choice.name: 1 for choice in program.choices}
    loop, beside = Loop(code, held=held), MonitoredSimulation(program, monitors)
    loop.begin(0)
    assert list(loop.frame[code.frames.monitors :]) == list(beside._states)
    for _ in range(30):
        loop.go(1)
        beside.cycle({"car": True})
        assert list(loop.frame[code.frames.monitors :]) == list(beside._states)
    assert "soon" in beside.settled
    stopping = Loop(code, held=held)
    stopping.control[control.UNTIL_SETTLED] = 1
    stopping.begin(0)
    assert stopping.go(1000) == control.DECIDED
    assert stopping.steps == -(-min(beside.settled.values()) // 3) * 3


# ---------------------------------------------------------------- time


@pytest.mark.slow
def test_two_turns_are_never_closer_than_a_period_less_the_jitter(tmp_path: Path) -> None:
    """Whatever the system does to the thread: nothing here depends on how late it is."""
    period, jitter = 1_000_000, 300_000
    code = code_of(load_arrangement(LIGHTS))
    loop = Loop(code, period=period, jitter=jitter)
    recorder = Recorder(tmp_path / "r", {}, loop)
    loop.limit(40)
    run = Run(loop, recorder)
    run.start()
    assert run.wait()
    frames = [turn.frame for turn in turns_of(tmp_path / "r")][1:-1]
    assert [frame[CYCLE] for frame in frames] == list(range(40))
    moved, starts = 0, []
    for frame in frames:
        late = frame[LATENESS]
        assert late >= 0 and frame[MOVED] - moved == (late if late >= period else 0)
        starts.append(frame[CYCLE] * period + moved + late)
        moved = frame[MOVED]
    assert all(later - sooner >= period - jitter for sooner, later in pairwise(starts))
    late = run.report.lateness
    assert late is not None and late.turns == 40 and late.moved == moved
    assert late.worst == max(frame[LATENESS] for frame in frames)
    assert late.overruns == sum(frame[LATENESS] >= period for frame in frames)
    assert [percent for percent, _ in late.percentiles] == [50.0, 99.0, 99.9]


@pytest.mark.slow
def test_stopping_ends_a_long_wait() -> None:
    """The second turn is due in an hour."""
    code = code_of(load_arrangement(LIGHTS))
    loop = Loop(code, period=3_600_000_000_000)
    run = Run(loop)
    run.start()
    while loop.number < 2:
        time.sleep(0.001)
    run.stop()
    assert run.wait() and run.report.ending == "stopped" and run.report.cycles == 1


@pytest.mark.parametrize("late", [0, 1, 7, 8, 9, 15, 16, 17, 100, 12_345, 10**6, 10**9 + 7, (1 << 62) - 1])
def test_a_lateness_is_in_its_bucket(late: int) -> None:
    number = late if late < 8 else (late.bit_length() - 3) * 8 + (late >> (late.bit_length() - 4) & 7)
    low, high = control.bucket_bounds(number)
    assert low <= late < high and high - low <= max(1, low // 8)
    counts = [0] * control.BUCKETS
    counts[number] = 1000
    assert percentiles(counts) == tuple((p, high - 1) for p in (50.0, 99.0, 99.9))


# ---------------------------------------------------------------- generations


class Memory:
    """A segment in this process, for frames of so many words."""

    def __init__(self, words: int) -> None:
        code = MachineCode(generations.llvm_text, "thorough")
        pointer, i64 = ctypes.c_void_p, ctypes.c_int64
        self.code = code
        self._publish = ctypes.CFUNCTYPE(None, pointer, pointer, i64)(code.address("publish"))
        self._newest = ctypes.CFUNCTYPE(i64, pointer, pointer, i64)(code.address("newest"))
        self.words = words
        self.segment = (ctypes.c_int64 * generations.segment_words(words))()
        self.copy = (ctypes.c_int64 * words)()

    def publish(self, number: int) -> None:
        frame = (ctypes.c_int64 * self.words)(number, *[number * 1000 + i for i in range(1, self.words)])
        self._publish(self.segment, frame, self.words)

    def newest(self) -> int:
        return self._newest(self.segment, self.copy, self.words)


@pytest.mark.parametrize("words", [1, 2, 7, 8, 9, 40])
def test_the_newest_frame_is_read_whole(words: int) -> None:
    memory = Memory(words)
    assert memory.newest() == 0
    for number in range(1, 12):
        memory.publish(number)
        assert memory.newest() == number
        assert list(memory.copy) == [number, *[number * 1000 + i for i in range(1, words)]]


def test_a_writer_that_dies_leaves_the_newest_frame() -> None:
    """The stamp of the next generation is cleared, and any part of its frame written: as at any moment of a kill."""
    memory = Memory(5)
    for number in (1, 2, 3, 4, 5):
        memory.publish(number)
    place = generations.HEADER_WORDS + (6 % 4) * generations.stride(5)
    for written in range(6):
        memory.segment[place : place + written] = [0, 99, 99, 99, 99, 99][:written]
        assert memory.newest() == 5 and memory.copy[1] == 5001


# ---------------------------------------------------------------- recordings


@pytest.mark.slow
def test_a_changed_recording_differs(tmp_path: Path) -> None:
    code = code_of(load_arrangement(LIGHTS))
    _, found = recorded(code, tmp_path / "r", 20, 5)
    given = range(code.frames.choices, code.frames.events)  # another choice that nobody reads is another run
    for word in set(range(code.frames.words)) - set(given):
        changed = list(found)
        frame = list(found[10].frame)
        frame[word] += 1
        changed[10] = Turn((), tuple(frame))
        if word in CLOCKED:
            assert len(list(replay(code, changed))) == len(found)
        else:
            with pytest.raises(Differs):
                list(replay(code, changed))


@pytest.mark.slow
@pytest.mark.parametrize("prescribed", [(7, 1, 0), (0, 1, 5), (0, 0, 1), (0, -1, 1)])
def test_what_is_prescribed_wrongly_differs(prescribed: tuple[int, int, int], tmp_path: Path) -> None:
    code = code_of(load_arrangement(LIGHTS))
    _, found = recorded(code, tmp_path / "r", 5, 5)
    with pytest.raises(Differs):
        list(replay(code, [*found[:3], Turn((Prescription(*prescribed),), found[3].frame)]))
    for word, value in ((ENDING, -9), (ENDING, 99), (PROCESS, 5), (STEPS, 1 << 60)):
        frame = list(found[3].frame)
        frame[word] = value
        with pytest.raises(Differs):
            list(replay(code, [*found[:3], Turn((), tuple(frame))]))
    with pytest.raises(Differs, match="words"):
        list(replay(code, [Turn((), found[0].frame[:-1])]))


@pytest.mark.slow
def test_a_choice_outside_its_type_differs(tmp_path: Path) -> None:
    code = code_of(load_arrangement(LIGHTS))
    _, found = recorded(code, tmp_path / "r", 5, 5)
    frame = list(found[3].frame)
    frame[code.frames.choices] = 9
    with pytest.raises(Differs, match=r"car = 9 is outside 0\.\.1"):
        list(replay(code, [*found[:3], Turn((), tuple(frame))]))


@pytest.mark.slow
def test_a_file_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "r").write_text("mine")
    loop = Loop(code_of(load_arrangement(LIGHTS)))
    with pytest.raises(DiagnosticError, match="E480"):
        Recorder(tmp_path / "r", {}, loop)
    assert (tmp_path / "r").read_text() == "mine"


@pytest.mark.slow
def test_the_ways_to_end(tmp_path: Path) -> None:
    document = {**LAMP, "whiteboard": {**LAMP["whiteboard"], "n": {"type": "0..3", "init": 0, "role": "output"}}}
    code = code_of(build_arrangement(document))
    loop = Loop(code, seed=1, drawn=drawn_choices(code.program, {}))
    loop.limit(100_000)
    run = Run(loop)
    run.start()
    assert run.wait()
    report = run.report
    assert report.ending == "fault" and report.fault is not None and report.fault.code == "F001"
    assert loop.frame[STEPS] == report.ringlets
    assert starting_values(lower(build_arrangement(document))) == {"on": 0}


@pytest.mark.slow
def test_a_recording_that_cannot_begin_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No descriptor, no file, and no address where the loop would write to what is unmapped."""
    loop = Loop(code_of(load_arrangement(LIGHTS)))
    calls: list[int] = []
    allocate = os.posix_fallocate

    def full(descriptor: int, offset: int, length: int) -> None:
        calls.append(length)
        if len(calls) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        allocate(descriptor, offset, length)

    monkeypatch.setattr(os, "posix_fallocate", full)
    before = len(list(Path("/proc/self/fd").iterdir()))
    with pytest.raises(DiagnosticError, match="No space left"):
        Recorder(tmp_path / "r", {}, loop)
    assert len(calls) == 2 and len(list(Path("/proc/self/fd").iterdir())) == before
    assert not loop.control[control.LOG] and not list(tmp_path.iterdir())
    loop.begin(0)
    loop.go(2)
    assert loop.number > 1
