"""Runs from Python: what they show, take and report."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.recording.file import HEAD, Recording
from llfsm_verify.runtime.recording.origin import code_of as code_of_recording
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.runtime.live.runs import turns_of
from tests.runtime.recording.forging import begin_of, sealed

ENDING_BY_ITSELF = """\
name: ending
cycle_ms: 10
whiteboard: {n: {type: 0..5}}
machines: {m: {inline: {machine: M, states: [{name: A, on_entry: "n = 1;"}]}}}
schedule: [m]
"""
BOTH = "both: G !(ns@GREEN && ew@GREEN)"


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["thread", "separate"])
def test_a_run_is_recorded_and_monitored(processes: str, tmp_path: Path) -> None:
    path = tmp_path / "r"
    run = lv.load(FAULTY).run(
        BOTH, simulate=True, seed=3, rate=0, cycles=300, record=path, stop_on=["violation"], processes=processes
    )
    report = run.wait()
    assert report.ending == "violated" and report.monitored == (("both", "violated", 23),)
    assert run.values()["verdict(both)"] == "violated" and run.values()["ns"] == "GREEN"
    assert llfsm("replay", str(path)).stdout.endswith("the same bit for bit, and then violated\n")
    assert "in frame 23" in llfsm("check-recording", str(path), "-p", BOTH).stdout
    again = lv.replay(path)
    assert isinstance(again, lv.RecordingOutcome) and again.as_expected and again.happens is True
    assert (again.frames, again.ending, again.notes, again.path) == (report.frames, "violated", (), path)
    assert again.run is not None and len(again.run) == report.ringlets
    assert all(again.run.values(-1)[name] == run.values()[name] for name in ("ns", "ew"))


@pytest.mark.slow
def test_recordings_that_are_not_the_same(tmp_path: Path) -> None:
    """A run that ends at once; another arrangement in its place, a missing end, and a recording of no cycle."""
    path, other = tmp_path / "r", tmp_path / "other.yaml"
    (tmp_path / "a.yaml").write_text(ENDING_BY_ITSELF)
    other.write_text(ENDING_BY_ITSELF.replace("n = 1", "n = 2"))
    assert lv.load(tmp_path / "a.yaml").run(rate=0, record=path).wait().ending == "ended"
    again = lv.replay(path)
    assert again.as_expected and again.run is not None and again.run.values(-1)["n"] == 1
    differs = lv.replay(path, lv.load(other))
    assert differs.happens is False and differs.run is None and "differs: frame 2" in str(differs)
    data = path.read_bytes()
    path.write_bytes(data[:-1])
    again = lv.replay(path)
    assert (again.happens, again.run, again.as_expected) == (None, None, False)
    assert str(again) == "damaged after frame 2, and the same until then: the end of the file is missing"
    head = data[: begin_of(data) - HEAD]
    path.write_bytes(sealed(head, [], bytes(4)).ljust(len(head) + 4096, b"\0"))
    again = lv.replay(path)
    assert str(again) == "0 cycles, and then nothing: the process was killed" and again.as_expected
    assert isinstance(again, lv.RecordingOutcome) and again.ending is None and again.run is not None
    assert len(again.run) == 0


@pytest.mark.slow
def test_a_recording_is_replayed_while_its_run_goes_on(tmp_path: Path) -> None:
    with lv.load(LIGHTS).run(rate=10, record=tmp_path / "r") as run:
        while "ns" not in run.values():
            pass
        again = lv.replay(tmp_path / "r")
        assert again.as_expected and str(again).endswith(", and the run goes on")
    assert str(lv.replay(tmp_path / "r")).endswith("and then stopped")


@pytest.mark.slow
def test_nothing_is_asked_of_a_run_that_has_ended() -> None:
    run = lv.load(LIGHTS).run(rate=0, cycles=2)
    run.wait()
    for ask in (lambda: run.post(car=True), lambda: run.command("suspend", "ns"), lambda: run.replace("ns", __file__)):
        with pytest.raises(ValueError, match="the run has ended"):
            ask()


@pytest.mark.slow
def test_inputs_are_posted_and_the_end_is_awaited() -> None:
    async def drive() -> lv.RunReport:
        run = lv.load(LIGHTS).run(rate=1000, inputs={"car": False})
        run.post(car=True)
        while run.values()["ew"] != "GREEN":  # noqa: ASYNC110 - there is no event of this
            await asyncio.sleep(0)
        run.stop()
        return await run

    assert asyncio.run(drive()).ending == "stopped"


@pytest.mark.slow
def test_others_read_and_post(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model = lv.load(Path(__file__).parents[2] / LIGHTS)
    monkeypatch.setenv("LLFSM_WHITEBOARDS", "w")
    with model.run(rate=1000, whiteboard="lights") as run, lv.Whiteboard("lights") as board:
        with board.subscribe("ew") as updates:
            board.post(car=True)
            assert next(update.number for update in updates if update.values["ew"] == "GREEN") > 1
        with pytest.raises(lv.WhiteboardError, match="in use"):
            model.run(whiteboard="lights")
        with pytest.raises(ValueError, match="no input `bus`"):
            run.post(bus=True)
        with pytest.raises(ValueError, match="the arrangement declares no `operators:`"):
            run.command("suspend", "ns")
        with pytest.raises(TimeoutError):
            run.wait(0)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"cycles": 0}, "`cycles`"), ({"rate": -1}, "`rate`"), ({"priority": 100}, "at most 99"),
        ({"stop_on": ["fault"]}, "`stop_on`"), ({"inputs": {"bus": 1}}, "bus"), ({"inputs": {"car": "maybe"}}, "car"),
        ({"processes": "many"}, "`processes`"), ({"cycle_ms": 0}, "positive"), ({"syntax": "prolog"}, "syntax"),
    ],
)  # fmt: skip
def test_wrong_options(options: dict[str, object], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        lv.load(LIGHTS).run(**options)


@pytest.mark.slow
def test_what_is_not_from_files_is_not_recorded(tmp_path: Path) -> None:
    model = lv.build(
        name="one", cycle_ms=1, machines={"m": {"inline": {"machine": "M", "states": [{"name": "S"}]}}}, schedule=["m"]
    )
    with pytest.raises(ValueError, match="must come from files"):
        model.run(record=tmp_path / "r")
    assert model.run(rate=0).wait().ending == "ended"


MOTORS = """\
name: motors
cycle_ms: 1
whiteboard:
  motor: {type: 0..100, init: 0, role: output, safe: 0}
machines:
  drive: {inline: {machine: Drive, states: [{name: ON, on_entry: motor = 77;, stays: true}]}}
schedule: [drive]
"""
FORGETS = """\
import asyncio, multiprocessing, sys, threading, time
from concurrent.futures import ThreadPoolExecutor
import llfsm_verify as lv

def main():
    run = lv.load("motors.yaml").run(whiteboard="motors", record="recording", processes=sys.argv[1])
    while run.values().get("motor") != 77:
        time.sleep(0.001)
    if sys.argv[2] == "waiting":
        threading.Thread(target=run.wait).start()
        ThreadPoolExecutor().submit(run.wait)
    return run

async def awaiting():
    await asyncio.wait_for(main(), 0.01)

if sys.argv[2] == "awaiting":
    asyncio.run(awaiting())
if sys.argv[2] == "child":
    child = multiprocessing.get_context("fork").Process(target=main)
    child.start()
    child.join()
    sys.exit(child.exitcode)
main()
if sys.argv[2] == "raise":
    raise ValueError("forgotten")
if sys.argv[2] == "exit":
    sys.exit(3)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("processes", "how", "code"),
    [
        ("thread", "end", 0),
        ("thread", "exit", 3),
        ("thread", "raise", 1),
        ("thread", "child", 0),
        ("thread", "waiting", 0),
        ("thread", "awaiting", 1),
        ("separate", "end", 0),
    ],
)
def test_a_run_that_is_forgotten_ends_with_the_program(processes: str, how: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "motors.yaml").write_text(MOTORS)
    environment = os.environ | {"LLFSM_WHITEBOARDS": "boards"}
    command = [sys.executable, "-c", FORGETS, processes, how]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == code and ("forgotten" in done.stderr) == (how == "raise")
    *_, last = turns_of(tmp_path / "recording")
    assert ENDINGS[last.frame[ENDING]] == "stopped"
    with Recording(tmp_path / "recording") as recording:
        slots = slots_of(code_of_recording(recording, lv.load(tmp_path / "motors.yaml").wrapped))
    assert next(slot for slot in slots if slot.name == "motor").value(last.frame) == 0
    assert not list((tmp_path / "boards").iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["thread", "separate"])
def test_a_child_cannot_end_the_run_of_its_parent(
    processes: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    with lv.load(LIGHTS).run(rate=1000, processes=processes, whiteboard="lights") as run:
        while not run.values():
            pass
        child = os.fork()
        if not child:
            refused = 0
            try:
                for ask in (run.stop, run.wait, run.values, run.post, lambda: run.command("suspend", "ns")):
                    try:
                        ask()
                    except RuntimeError:
                        refused += 1
                run.__exit__()
                refused += run._launched.server._listening.fileno() == -1  # nobody would answer who calls there
            finally:
                os._exit(refused)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 6
        frame = run.wrapped.shared.segment.newest()
        while run.wrapped.shared.segment.newest() <= frame:
            pass
        assert run.stop() is None and run.wait().ending == "stopped"
