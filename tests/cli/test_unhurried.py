"""Output of a supervisor that nobody takes: it waits for nobody, and a run ends safely all the same."""

from __future__ import annotations

import errno
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TextIO

import pytest

from llfsm_verify.cli.io import standard_error as unhurried
from llfsm_verify.cli.io.standard_error import MOST_WAITING, Unhurried
from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError

MOTORS = """\
name: motors
cycle_ms: 1
whiteboard:
  level: {type: 0..9, init: 0, role: input}
  motor: {type: 0..100, init: 0, role: output, safe: 0}
machines:
  drive:
    inline:
      machine: Drive
      states:
        - {name: ON, on_entry: motor = 77;, transitions: [{when: level == 9, to: ON}]}
schedule: [drive]
"""
PORTS = """\
ports:
  sensor: {kind: stream, read: sensor.pipe, inputs: {level: level}, on_failure: stale}
"""


def fill(descriptor: int, most: int) -> None:
    """Write until nothing can be written any more, or so many bytes."""
    os.set_blocking(descriptor, False)
    try:
        while most > 0:
            most -= os.write(descriptor, b"." * min(most, 512))
    except BlockingIOError:
        pass
    os.set_blocking(descriptor, True)


def stream(kind: str, most: int = 1 << 24) -> tuple[TextIO, int]:
    """One that is full, or has so many bytes, and the descriptor by which it is read."""
    if kind == "socket":
        ours, theirs = socket.socketpair()
        theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)  # as small as can be
        reads, writes = ours.detach(), theirs.detach()
    else:
        reads, writes = os.pipe() if kind == "pipe" else pty.openpty()
    fill(writes, most)
    return open(writes, "w"), reads


def taken(reads: int) -> bytes:
    """All that can be read now."""
    data = b""
    while select.select([reads], [], [], 0)[0]:
        data += os.read(reads, 1 << 16)
    return data


@contextmanager
def of_another_user(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The descriptions behind descriptors cannot be opened again."""

    def refuse(path: object, *_: object) -> int:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)

    with monkeypatch.context() as patched:
        patched.setattr(unhurried.os, "open", refuse)
        yield


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("kind", ["pipe", "terminal", "socket"])
def test_what_cannot_be_written_waits(kind: str, own: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    said, reads = stream(kind)
    if kind == "terminal":  # the kernel may pass on later what fills it
        termios.tcflow(said, termios.TCOOFF)
    with said, nullcontext() if own else of_another_user(monkeypatch), Unhurried(said) as out:
        before = os.get_blocking(said.fileno())
        print("first", file=out)
        print("second ü", file=out)
        assert out.waits and b"first" not in taken(reads)
        if kind == "terminal":
            termios.tcflow(said, termios.TCOON)
        found = b""
        while not found.endswith("first\nsecond ü\n".encode()):
            out.flush()
            found += taken(reads).replace(b"\r", b"")
        assert not found.strip(b".").removeprefix("first\nsecond ü\n".encode()) and not out.waits
        assert os.get_blocking(said.fileno()) == before  # others have the same stream
    os.close(reads)


@pytest.mark.parametrize("filled", [0, 97, 400, 4000, 4200, 7600, 7900, 8100, 8191, 1 << 17])
@pytest.mark.parametrize("kind", ["pipe", "terminal", "socket"])
def test_what_is_written_is_taken_at_once(kind: str, filled: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However full the pipe, the terminal or the socket of another user is."""
    said, reads = stream(kind, filled)
    os.set_blocking(said.fileno(), False)  # a write that would wait writes less
    pieces, real = list[tuple[int, int]](), os.write

    def write(to: int, data: bytes) -> int:
        pieces.append((-1, len(data)))
        pieces[-1] = (real(to, data), len(data))
        return pieces[-1][0]

    monkeypatch.setattr(unhurried, "LAST", 0.0)
    with said, of_another_user(monkeypatch), Unhurried(said) as out:
        monkeypatch.setattr(unhurried.os, "write", write)
        out.write("\nabcdefghijklmnopqrstuvw\n\n\tx" * 5000)
    os.close(reads)
    assert all(sent == asked for sent, asked in pieces)
    assert pieces or filled


def test_what_is_too_much_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unhurried, "LAST", 0.0)
    said, reads = stream("pipe")
    with said:
        with Unhurried(said) as out:
            for _ in range(3):
                out.write("x" * MOST_WAITING)
            assert out.waits
        os.close(reads)


@pytest.mark.parametrize("kind", ["pipe", "socket"])
def test_a_reader_that_is_gone_is_no_error(kind: str) -> None:
    said, reads = stream(kind)
    os.close(reads)
    with said, Unhurried(said) as out:
        print("nobody", file=out)
        assert not out.waits


def test_files_are_written_at_once(tmp_path: Path) -> None:
    with open(tmp_path / "log", "w") as log:
        log.write("before\n")
        with Unhurried(log) as out:
            print("said", file=out)
            assert (tmp_path / "log").read_text() == "before\nsaid\n"
        log.write("after\n")
    assert (tmp_path / "log").read_text() == "before\nsaid\nafter\n"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["terminal", "pipe"])
def test_output_that_nobody_takes_does_not_hold_a_run(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The panel on a terminal, and on a pipe what is said of a port that reads nonsense."""
    (tmp_path / "motors.yaml").write_text(MOTORS)
    (tmp_path / "ports.yaml").write_text(PORTS)
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    os.mkfifo(tmp_path / "sensor.pipe")
    sensor = os.open(tmp_path / "sensor.pipe", os.O_RDWR)
    os.write(sensor, b"nonsense\n{}\n[1]\n")
    said, reads = stream(kind)
    command = [sys.executable, "-m", "llfsm_verify", "run", "motors.yaml", "--whiteboard", "motors"]
    if kind == "terminal":
        run = subprocess.Popen([*command, "--panel"], cwd=tmp_path, stdout=said, stderr=said)
    else:
        run = subprocess.Popen(
            [*command, "--ports", "ports.yaml"], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=said
        )
    said.close()
    try:
        board = None
        while board is None:
            assert run.poll() is None
            try:
                board = Whiteboard("motors")
            except WhiteboardError:
                time.sleep(0.01)
        with board:
            while board.view().values["motor"] != 77:
                time.sleep(0.01)
            while kind == "pipe" and select.select([sensor], [], [], 0)[0]:
                time.sleep(0.01)  # until it has been read, and something is to be said
            run.send_signal(signal.SIGTERM)
            while board.view().values["motor"] != 0:
                time.sleep(0.01)
            assert board.view().ending == "stopped"
        while run.poll() is None:  # what it says last is read
            with suppress(OSError):  # of a terminal whose other end is closed
                if select.select([reads], [], [], 0.05)[0]:
                    os.read(reads, 1 << 16)
        assert run.returncode == 0
    finally:
        if run.poll() is None:
            run.kill()
            run.wait()
        os.close(reads)
        os.close(sensor)
