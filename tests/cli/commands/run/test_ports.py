"""`llfsm run --ports`: a run among pipes and signals, as users start it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from tests.cli.running import LIGHTS, llfsm
from tests.processes import ended

PAGE = Path("docs/ports.md").read_text(encoding="utf-8")
STREAMS = PAGE.partition("```yaml\n")[2].partition("```")[0]
"""The example of the documentation."""
NOTHING = "ports: {world: {kind: callback, call: 'os.path:commonprefix', inputs: [car], on_failure: stale}}\n"


def started(folder: Path, *more: str) -> subprocess.Popen[str]:
    ports = folder / "lights.ports.yaml"
    ports.write_text(STREAMS)
    command = [sys.executable, "-m", "llfsm_verify", "run", LIGHTS, "--rate", "100", "--ports", str(ports), *more]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1
    )


@pytest.mark.slow
def test_standard_streams_and_a_writer_that_closes(tmp_path: Path) -> None:
    process = started(tmp_path)
    try:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write('{"car": true}\n{"car": 1}\n')
        while json.loads(process.stdout.readline())["ew"] != "GREEN":
            pass
        process.stdin.close()
        process.stdin = None
    finally:
        output, errors = ended(process)
    assert process.returncode == 1
    assert json.loads(output.splitlines()[-1]) == {"ns": "RED", "ew": "RED"}
    assert all(json.loads(line) for line in output.splitlines()), "nothing else is on standard output"
    assert "s: stopped: port world: the writer has closed it: `car` failed\n" in errors
    assert "port world: a value is refused: car: `1` is neither true nor false\n" in errors
    assert "\nport world: 1 message in, 1 value refused, 1 failure, " in errors and " messages out\n" in errors


@pytest.mark.slow
def test_an_input_that_a_port_feeds_belongs_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the whiteboard of the run others cannot post it; and a signal ends the run with safe values."""
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path))
    process = started(tmp_path, "--whiteboard", "lights")
    try:
        assert process.stdout is not None
        process.stdout.readline()  # it runs
        with Whiteboard("lights") as board:
            with pytest.raises(PostRefused, match="`car` comes from a port"):
                board.post(car=True)
            assert board.get("car") is False
        process.send_signal(signal.SIGTERM)
        process.wait()  # before its standard input is closed
    finally:
        output, errors = ended(process)
    assert process.returncode == 0 and json.loads(output.splitlines()[-1]) == {"ns": "RED", "ew": "RED"}
    assert "`car` comes from a port" in errors and "s of logical time" in errors
    with pytest.raises(WhiteboardError):
        Whiteboard("lights")


@pytest.mark.slow
def test_a_loop_that_is_killed_leaves_safe_values(tmp_path: Path) -> None:
    process = started(tmp_path)
    try:
        assert process.stdout is not None
        process.stdout.readline()  # it runs
        (loop,) = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        os.kill(int(loop), signal.SIGKILL)
        process.wait()  # before its standard input is closed
    finally:
        output, errors = ended(process)
    assert process.returncode == 1 and "a process died" in errors
    assert json.loads(output.splitlines()[-1]) == {"ns": "RED", "ew": "RED"}


@pytest.mark.slow
def test_inputs_of_ports_are_not_drawn(tmp_path: Path) -> None:
    ports = tmp_path / "ports.yaml"
    ports.write_text(NOTHING)
    found = []
    for name, more in (("fed", ("--ports", str(ports))), ("drawn", ())):
        recording = str(tmp_path / name)
        extent = ("--simulate", "--seed", "1", "--for", "50s", "--rate", "0", "--record", recording)
        assert llfsm("run", LIGHTS, *extent, *more).returncode == 0
        found.append(llfsm("check-recording", recording, "-p", "G !car").stdout.split()[0])
    assert found == ["undecided", "violated"]


@pytest.mark.slow
def test_what_does_not_go_with_ports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ports = tmp_path / "ports.yaml"
    ports.write_text(STREAMS)
    given = ("run", LIGHTS, "--ports", str(ports))
    for arguments, said in (
        ((*given, "--set", "car=true"), "--set car: port `world` feeds it"),
        ((*given, "--inputs", "x"), "--inputs"),
    ):
        done = llfsm(*arguments)
        assert done.returncode == 2 and said in done.stderr
    text = "name: a\ncycle_ms: 5\nwhiteboard: {car: {type: bool, role: input}}\nschedule: [m]\n"
    text += "machines: {m: {inline: {machine: M, states: [{name: S}]}}}\n"
    ports.write_text("ports: {w: {kind: stream, read: stdin, inputs: [car], on_failure: stale}}\n")
    done = llfsm("run", "-", "--ports", str(ports), stdin=text)
    assert done.returncode == 2 and "standard input cannot be both" in done.stderr
    done = llfsm("run", LIGHTS, "--ports", str(tmp_path / "nothing"))
    assert done.returncode == 3 and "error[E001]" in done.stderr
    ports.write_text("ports: {w: {kind: serial, device: d, inputs: [car], on_failure: stale}}\n")
    monkeypatch.setitem(sys.modules, "serial", None)  # as if it was not installed
    recording = tmp_path / "r"
    done = llfsm("run", LIGHTS, "--ports", str(ports), "--record", str(recording))
    assert not recording.exists(), "nothing is in it, and the next run shall make it"
    assert done.returncode == 3 and "pip install -e '.[serial]'" in done.stderr
