"""A supervisor and the processes of a run: who ends it, and what the last frame says then."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.live import forks
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import drawn_choices, safe_values, starting_values
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.recording import file
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.whiteboard import segment
from llfsm_verify.runtime.whiteboard.segment import Attached
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower
from tests.quick import FRESH, many
from tests.runtime.live.runs import pids, turns_of

STATE = {"name": "S", "internal": "n = n % 1000 + 1; motor = 1 + n % 3; row[1] = 7;", "transitions": []}
DOCUMENT = {
    "name": "motors",
    "cycle_ms": 1,
    "whiteboard": {
        "x": {"type": "bool", "role": "input"},
        "motor": {"type": "0..3", "init": 1, "role": "output", "safe": 0},
        "row": {"type": {"array": "0..9", "size": 2}, "role": "output", "init": [1, 1], "safe": [4, 5]},
        "other": {"type": "bool", "role": "output", "init": True},
    },
    "machines": {
        name: {
            "inline": {
                "machine": name.upper(),
                "variables": {"n": {"type": "0..1000", "init": 0}},
                "states": [{**STATE, "transitions": [{"when": "x", "to": "T"}]}, {**STATE, "name": "T", "stays": True}],
            }
        }
        for name in "abc"
    },
    "processes": {"p": ["a"], "q": ["b", "c"]},
}


def several() -> Arrangement:
    return build_arrangement(DOCUMENT)


@contextmanager
def running(
    arrangement: Arrangement, record: Path | None = None, *, together: bool = False, rounds: int = -1, period: int = 0
) -> Iterator[tuple[Supervised, Shared]]:
    code = LiveCode(lower(arrangement, keep_all_bits=True), safe=safe_values(arrangement))
    drawn = drawn_choices(code.program, {})
    loop = Loop(code, held=starting_values(code.program), seed=7, drawn=drawn, period=period)
    loop.limit(rounds)
    with closing(Shared("test", loop)) as shared:
        recorder = None if record is None else Recorder(record, {}, loop)
        with Supervised(loop, shared, recorder, together=together) as run:
            yield run, shared


def values(shared: Shared) -> dict[str, object]:
    code = shared.loop.code
    frame = shared.segment.newest()
    assert frame is not None
    return {slot.name: slot.value(frame) for slot in slots_of(code)}


SAFE = {"motor": 0, "row[0]": 4, "row[1]": 5, "other": True}


@pytest.mark.slow
def test_processes_with_a_token_do_what_one_thread_does(tmp_path: Path) -> None:
    found = []
    for together in (False, True):
        path = tmp_path / str(together)
        with running(several(), path, together=together, rounds=50) as (run, shared):
            assert len(pids(run)) == (1 if together else 2)
            run.start()
            assert run.wait()
            assert run.report.ending == "stopped" and run.report.cycles == 50
            assert run.report.frames == run.report.recorded == 102
            assert {**values(shared), **SAFE} == values(shared)
        turns = turns_of(path)
        arrangement = several()
        code = LiveCode(lower(arrangement, keep_all_bits=True), safe=safe_values(arrangement))
        assert list(replay(code, turns)) == turns
        found.append([(*turn.frame[:2], *turn.frame[5:]) for turn in turns])
    assert found[0] == found[1]


@pytest.mark.slow
def test_who_ends_by_itself_keeps_what_it_wrote() -> None:
    machines = {
        name: {"inline": {"machine": "M", "states": [{"name": "S", "on_entry": "motor = 2;"}]}} for name in "ab"
    }
    document = {**DOCUMENT, "machines": machines, "processes": {"p": ["a"], "q": ["b"]}}
    with running(build_arrangement(document)) as (run, shared):
        run.start()
        assert run.wait() and run.report.ending == "ended"
        assert values(shared)["motor"] == 2


@pytest.mark.slow
def test_a_fault_leaves_safe_values() -> None:
    bad = {
        "name": "S",
        "internal": "motor = 2; row[0] = 9 / (3 - n); n = n + 1;",
        "transitions": [{"when": "n < 0", "to": "S"}],
    }
    machine = {"inline": {"machine": "M", "variables": {"n": {"type": "0..9", "init": 0}}, "states": [bad]}}
    document = {**DOCUMENT, "machines": {"a": machine}, "processes": {"p": ["a"]}}
    with running(build_arrangement(document)) as (run, shared):
        run.start()
        assert run.wait()
        assert run.report.ending == "fault" and run.report.fault is not None and run.report.fault.code == "F002"
        assert {**values(shared), **SAFE} == values(shared) and values(shared)["a.n"] == 3


def kill_once(folder: Path, number: int, *, process: int, together: bool) -> None:
    """Kill a process of a run at some moment: the last frame is whole and safe, and so is the recording."""
    path = folder / str(number)
    with running(several(), path, together=together) as (run, shared):
        run.start()
        while (newest := shared.segment.newest()) is None or newest[NUMBER] < 3 + 7 * number % 60:
            time.sleep(0)
        killed = time.monotonic_ns()
        os.kill(pids(run)[process], signal.SIGKILL)
        assert run.wait()
        report = run.report
        assert report.ending == "died" and report.detail == signal.SIGKILL
        last = shared.segment.newest()
        assert last is not None and ENDINGS[last[ENDING]] == "died" and last[2] >= killed
        assert {**values(shared), **SAFE} == values(shared)
    turns = turns_of(path)
    assert list(turns[-1].frame) == last
    assert [turn.frame[NUMBER] for turn in turns] == list(range(1, len(turns) + 1))
    arrangement = several()
    code = LiveCode(lower(arrangement, keep_all_bits=True), safe=safe_values(arrangement))
    assert list(replay(code, turns)) == turns
    assert last[STEPS] == turns[-2].frame[STEPS]
    path.unlink()


@pytest.mark.slow
@pytest.mark.parametrize(("process", "together"), [(0, True), (0, False), (1, False)])
def test_a_process_that_is_killed(process: int, together: bool, tmp_path: Path) -> None:
    for number in range(many(40)):
        kill_once(tmp_path, number, process=process, together=together)


@pytest.mark.long
@pytest.mark.parametrize(("process", "together"), [(0, True), (0, False), (1, False)])
def test_many_processes_that_are_killed(process: int, together: bool, tmp_path: Path) -> None:
    for number in range(many(300)):
        kill_once(tmp_path, number, process=process, together=together)


def nothing_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on compiling and mapping memory are errors, in this process and those that it forks."""

    def refuse(*_: object, **__: object) -> object:
        raise AssertionError("something is compiled, or memory is mapped, before outputs are safe")

    for place in ("llfsm_verify.backends.native.machine_code.MachineCode.__init__", "mmap.mmap", "os.memfd_create"):
        monkeypatch.setattr(place, refuse)
    monkeypatch.setattr(segment, "MachineCode", refuse)
    monkeypatch.setattr(segment.Mapped, "__init__", refuse)


@pytest.mark.slow
@pytest.mark.parametrize("recorded", [False, True])
def test_nothing_is_compiled_or_mapped_when_the_loop_dies(
    recorded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(segment, "code", cache(segment._Code))  # as in a process that has read no whiteboard yet
    with running(several(), tmp_path / "r" if recorded else None) as (run, shared):
        run.start()
        while shared.loop.number < 5:
            time.sleep(0)
        with monkeypatch.context() as patched:
            nothing_is_made(patched)
            os.kill(pids(run)[0], signal.SIGKILL)
            assert run.wait()
        assert {**values(shared), **SAFE} == values(shared)


@pytest.mark.slow
@pytest.mark.parametrize("recorded", [False, True])
def test_nothing_is_compiled_or_mapped_when_the_supervisor_dies(
    recorded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(segment, "code", cache(segment._Code))
    code = LiveCode(lower(several(), keep_all_bits=True), safe=safe_values(several()))
    loop = Loop(code, held=starting_values(code.program), period=1_000_000)
    with closing(Shared("test", loop)) as shared:
        recorder = Recorder(tmp_path / "r", {}, loop) if recorded else None
        told, tells = os.pipe()
        goes, go = os.pipe()
        supervisor = os.fork()
        if not supervisor:
            try:
                monkeypatch.setattr(forks, "fork", lambda: nothing_is_made(monkeypatch) or os.fork())
                run = Supervised(loop, shared, recorder, together=True)
                os.write(tells, pids(run)[0].to_bytes(4, "little"))
                os.read(goes, 1)  # until the test knows the loop by a descriptor
                run.start()
                while shared.segment.newest() is None:
                    time.sleep(0)
            finally:
                os._exit(0)
        os.close(tells)
        process = os.pidfd_open(int.from_bytes(os.read(told, 4), "little"))
        os.write(go, b"g")
        os.waitpid(supervisor, 0)
        select.select([process], [], [])  # until the loop has ended as well
        for descriptor in (told, goes, go, process):
            os.close(descriptor)
        newest = shared.segment.newest()
        assert newest is not None and ENDINGS[newest[ENDING]] == "died"
        assert {**values(shared), **SAFE} == values(shared)
        if recorder is not None:
            recorder.close()


@pytest.mark.slow
def test_a_child_does_not_keep_the_loop_going() -> None:
    """Of a process that the user's program forks, no descriptor is left by which the loop knows its supervisor."""
    with running(several(), together=True, period=1_000_000) as (run, _):
        run.start()
        own = {run._lifeline._held, *run._reports}
        child = os.fork()
        if not child:
            left = 99
            try:
                left = len([number for number in own if Path(f"/proc/self/fd/{number}").exists()])
            finally:
                os._exit(left)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        assert all(Path(f"/proc/self/fd/{number}").exists() for number in own)


SUPERVISOR = """
import sys, time
from pathlib import Path
from tests.runtime.live.test_supervised import pids, running, several
with running(several(), Path(sys.argv[1]), together=sys.argv[2] == "True") as (run, shared):
    print(f"/proc/{__import__('os').getpid()}/fd/{shared.segment.descriptor}", *pids(run), flush=True)
    run.start()
    run.wait()
"""


def kill_supervisor(path: Path, *, together: bool, frames: int) -> None:
    """The loop notices, commits safe values, and ends."""
    supervisor = subprocess.Popen(
        [sys.executable, "-c", SUPERVISOR, str(path), str(together)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert supervisor.stdout is not None
        place, *pids = supervisor.stdout.readline().split()
        descriptor = os.open(place, os.O_RDONLY)
        attached = Attached(descriptor)
        os.close(descriptor)
        while attached.latest < frames:
            time.sleep(0.001)
    finally:
        supervisor.kill()
        supervisor.communicate()
    while True:
        last = attached.newest()
        assert last is not None
        if last[ENDING]:
            break
        time.sleep(0.001)
    assert ENDINGS[last[ENDING]] == "died"
    for pid in pids:
        while Path(f"/proc/{pid}/stat").exists() and " Z " not in Path(f"/proc/{pid}/stat").read_text():
            time.sleep(0.001)
    turns = turns_of(path)
    assert list(turns[-1].frame) == last
    attached.close()
    path.unlink()


@pytest.mark.slow
@pytest.mark.parametrize("together", [True, False])
def test_a_supervisor_that_is_killed(together: bool, tmp_path: Path) -> None:
    kill_supervisor(tmp_path / "r", together=together, frames=50)


@pytest.mark.long
def test_many_supervisors_that_are_killed(tmp_path: Path) -> None:
    for number in range(300 if FRESH else 10):
        kill_supervisor(tmp_path / "r", together=number % 2 == 0, frames=1 + 7 * number % 60)


@pytest.mark.slow
def test_stopping() -> None:
    with running(several(), period=3_600_000_000_000) as (run, shared):
        run.start()
        while (newest := shared.segment.newest()) is None or newest[NUMBER] < 3:
            time.sleep(0.001)
        run.stop(signal.SIGTERM)
        assert run.wait() and run.report.ending == "stopped" and run.report.detail == signal.SIGTERM
        assert {**values(shared), **SAFE} == values(shared)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"type": "0..3", "safe": 0}, "E057.*only an output"),
        ({"type": "0..3", "role": "output", "safe": 4}, "outside `motor`'s range"),
        ({"type": {"array": "bool", "size": 2}, "role": "output", "safe": True}, "a list is expected"),
    ],
)
def test_safe_values_that_are_wrong(given: dict[str, object], why: str) -> None:
    board = {"x": {"type": "bool", "role": "input"}, "motor": given}
    machine = {"inline": {"machine": "M", "states": [{"name": "S"}]}}
    document = {"name": "wrong", "cycle_ms": 1, "whiteboard": board, "machines": {"a": machine}, "schedule": ["a"]}
    with pytest.raises(DiagnosticError, match=why):
        build_arrangement(document)


@pytest.mark.slow
def test_processes_record_beyond_what_each_has_mapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file, "WINDOW", 1 << 12)
    with running(several(), tmp_path / "r", rounds=600) as (run, _):
        run.start()
        assert run.wait() and run.report.ending == "stopped"
    assert (tmp_path / "r").stat().st_size > 1 << 13
    turns = turns_of(tmp_path / "r")
    assert len(turns) == run.report.recorded == 1202
    code = LiveCode(lower(several(), keep_all_bits=True), safe=safe_values(several()))
    assert list(replay(code, turns)) == turns
