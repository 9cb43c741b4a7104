"""Runs from Python that go on with another machine or policy."""

from __future__ import annotations

import errno
import os
import threading
import time
from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.whiteboard.permissions import user_name
from llfsm_verify.runtime.whiteboard.places import socket_path
from tests.cli.running import llfsm
from tests.runtime.recording.test_file import Full

OWN = user_name(os.getuid())
ARRANGEMENT = f"""\
name: counter
cycle_ms: 1
whiteboard:
  go: {{type: bool, role: input}}
  out: {{type: 0..9, init: 0, role: output}}
machines:
  count: {{file: count.yaml}}
  other: {{inline: {{machine: Other, states: [{{name: S, stays: true}}]}}}}
schedule: [count, other]
operators: {{replace: [count], policy: [{OWN}]}}
access: {{file: open.yaml}}
"""
OPEN = f"levels: [low, high]\nusers: {{{OWN}: high}}\non_violation: refuse\n"
MACHINE = (
    "machine: M\nvariables: {{n: {{type: 0..9, init: 0}}}}\nstates:\n  - {{name: {0}, internal: {1}, stays: true}}\n"
)
TEXTS = {
    "a": ARRANGEMENT, "open": OPEN, "locked": OPEN + "write: {out: high}\n",
    "shared": OPEN.replace("high}", "high, somebody: low}"),
    "wide": OPEN + "machines: {other: high}\n",
    "levels": OPEN.replace("low, high", "high, low"),
    "count": MACHINE.format("UP", "n = (n + 1) % 10; out = n;"),
    "down": MACHINE.format("DOWN", "n = (n + 9) % 10; out = n;"),
    "divides": MACHINE.format("S", "out = 9 / n;"), "wrong": MACHINE.format("S", "m = 1;"),
}  # fmt: skip


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    for name, text in TEXTS.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["thread", "separate"])
def test_a_run_goes_on_with_another_machine_and_policy(counter: Path, processes: str) -> None:
    model, path = lv.load(counter / "a.yaml"), counter / "r"
    with model.run("small: G out < 10", record=path, processes=processes) as run:
        with pytest.raises(ValueError, match="does not declare replace of `other`"):
            run.replace("other", counter / "down.yaml")
        with pytest.raises(ValueError, match="there is no variable `m`"):
            run.replace("count", counter / "wrong.yaml")
        with pytest.raises(ValueError, match=r"division by zero.*r\.refused\.1"):
            run.replace("count", counter / "divides.yaml")
        for name, why in (("wide", "gets a higher clearance"), ("levels", "has its levels, in their order")):
            with pytest.raises(ValueError, match=why):
                run.policy(counter / f"{name}.yaml")
        with pytest.raises(FileNotFoundError):
            run.policy(counter / "nowhere.yaml")
        assert run.values()["count"] == "UP"
        run.post(go=True)
        frame, notes = run.replace("count", counter / "down.yaml")
        assert run.values()["count"] == "DOWN" and notes[-1].startswith("checked: ")
        later = run.policy(counter / "locked.yaml").frame
        assert later > frame
        out = run.values()["out"]
        while run.values()["count.n"] == out:
            time.sleep(0.001)
        assert run.values()["out"] == out and run.values()["go"] is True
    report = run.wait()
    assert report.ending == "stopped" and report.frames > later and report.seconds > 0
    with pytest.raises(ValueError, match="the run has ended"):
        run.policy(counter / "open.yaml")
    for number in ("", ".2", ".3"):
        assert "the same bit for bit" in llfsm("replay", f"{path}{number}").stdout
    (counter / "a.yaml").write_text(ARRANGEMENT.replace("open.yaml", "locked.yaml"))
    with Recording(f"{path}.3") as recording:
        assert recording.header["policy"] == policy_digest(lv.load(counter / "a.yaml").wrapped)
        assert [len(entry) for entry in recording.header["loaded"]] == [4, 3]


@pytest.mark.slow
def test_clients_of_its_whiteboard_change_it_too(counter: Path) -> None:
    with lv.load(counter / "a.yaml").run(whiteboard="counter") as run:
        while not run.values():
            time.sleep(0.001)
        with lv.Whiteboard("counter") as board:
            assert socket_path("counter").stat().st_mode & 0o777 == 0o600
            board.policy(counter / "shared.yaml")
        assert socket_path("counter").stat().st_mode & 0o777 == 0o666, "the new policy names another user"
        with lv.Whiteboard("counter") as board:
            begun = board.told
            assert (begun["arrangement"], begun["cycle_ms"]) == (str(counter / "a.yaml"), "1")
            assert (begun["digest"], begun["replaced"]) == (lv.load(counter / "a.yaml").wrapped.digest, [])
            frame = board.replace("count", counter / "down.yaml", unchecked=True).frame
        with lv.Whiteboard("counter") as board:
            assert (board.told["digest"], board.told["replaced"]) == (begun["digest"], ["count"])
            assert board.frame(frame) is not None and board.frame(board.latest + 1000) is None
        assert run.values()["count"] == "DOWN" and frame > 1
        assert repr(run) == "<LiveRun: it runs>"
        with (
            lv.Whiteboard("counter") as board,
            pytest.raises(TypeError, match=r"^name one of .*count.*`view\(\).values`"),
        ):
            board.get()
    report = run.wait()
    assert str(run) == f"<LiveRun: stopped after {report.cycles:,} cycles>"


@pytest.mark.slow
def test_an_end_that_comes_first_refuses(counter: Path) -> None:
    """The program that asks waits for the check, and another thread stops the run."""
    (counter / "grows.yaml").write_text(
        MACHINE.format("S", "n = n;").replace("0..9", "int").replace("n = n;", "n = n + 1;")
    )
    with lv.load(counter / "a.yaml").run() as run:
        stopping = threading.Timer(0.2, run.stop)
        stopping.start()
        with pytest.raises(ValueError, match="the run has ended"):
            run.replace("count", counter / "grows.yaml")
        stopping.join()
    assert run.wait().ending == "stopped"


@pytest.mark.slow
def test_what_is_not_from_files_stays(counter: Path) -> None:
    model = lv.load(counter / "a.yaml")
    (counter / "a.yaml").write_text(ARRANGEMENT + "# edited\n")
    with model.run() as run, pytest.raises(ValueError, match="does not come from files"):
        run.replace("count", counter / "down.yaml")


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["thread", "separate"])
def test_a_recording_that_ended_early_is_told_after_another_machine(
    counter: Path, processes: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one, of a run that another one went on with."""
    Full(monkeypatch, 3)
    with lv.load(counter / "a.yaml").run(record=counter / "r", rate=20, processes=processes) as run:
        while not recording_ended(counter / "r"):
            time.sleep(0.001)
        monkeypatch.undo()
        run.replace("count", counter / "down.yaml", unchecked=True)
    report = run.wait()
    assert report.ending == "stopped" and report.unrecorded == os.strerror(errno.ENOSPC)
    with Recording(counter / "r") as first, Recording(counter / "r.2") as second:
        assert report.recorded == len(list(first)) + len(list(second)) - 2, "where one ends the other begins"
        assert str(first.lost).startswith("the file could not grow") and second.lost is None


def recording_ended(path: Path) -> bool:
    with Recording(path) as recording:
        return bool(recording._closed)
