"""How long an operator's command takes while other processes attack the whiteboard of a run.

`python -m benchmarks.attacks [--commands N] [--attackers N] [ATTACK…]`. Run by root, the attackers are the account
`daemon`, which has the lowest level, or `nobody`, who may not connect; run by somebody else, they are that user. Of
each attack the table has the median and the worst command over a connection that stays open, the same for a new
connection with each command, and how many commands were not taken; with any, the exit code is 1. A command waits for
the beginning of a cycle.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from llfsm_verify.runtime.whiteboard import client
from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.permissions import user_name
from llfsm_verify.runtime.whiteboard.places import MOST_REQUEST, socket_path

NAME = "benchmarks.attacks"
CYCLE_MS = 10
RUN = {
    "name": "attacked",
    "cycle_ms": CYCLE_MS,
    "whiteboard": {"car": {"type": "bool", "role": "input"}, "wish": {"type": "0..100", "init": 0}},
    "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "S", "stays": True}]}}},
    "schedule": ["m"],
    "operators": {"write": ["wish"]},
    "access": {
        "levels": ["low", "high"], "machines": {"m": "high"}, "write": {"wish": "high"},
        "users": {user_name(os.getuid()): "high", "daemon": "low"},
    },
}  # fmt: skip
DAEMON, NOBODY = 1, 65534
Attack = Callable[[str], None]
"""Goes on until the process is killed."""


def called(path: str) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX)
    connection.connect(path)
    connection.recv(1 << 16)
    return connection


def crowd(path: str) -> None:
    """Connections that say nothing, as many as there are."""
    held = []
    while True:
        with suppress(OSError):
            held.append(called(path))
        time.sleep(0.001 if len(held) < 100 else 1)


def flood(path: str, request: bytes = b'{"post": {}}\n' * 5000) -> None:
    """As much as goes through four connections, and nothing is read."""
    connections: list[socket.socket] = []
    while True:
        with suppress(OSError):
            while len(connections) < 4:
                connections.append(called(path))
                connections[-1].setblocking(False)
        sent = 0
        for connection in connections[:]:
            try:
                sent += connection.send(request)
                connection.recv(1 << 20)
            except BlockingIOError:
                pass
            except OSError:
                connections.remove(connection)
        if not sent:
            time.sleep(0.0001)


def garbage(path: str) -> None:
    """Deep JSON, bytes that are no text, requests that are refused."""
    lines = (b"[" * 5000, b"\xff" * 1000, b'{"post": {"car": "x"}}', b'{"command": ["write", "wish", 1]}')
    flood(path, b"".join(line + b"\n" for line in lines) * 50)


def long(path: str) -> None:
    """Requests that have no end."""
    flood(path, b"x" * MOST_REQUEST)


def slow(path: str) -> None:
    """A byte at a time, on many connections."""
    connections: list[socket.socket] = []
    while True:
        with suppress(OSError):
            while len(connections) < 16:
                connections.append(called(path))
        for connection in connections[:]:
            try:
                connection.send(b"{")
            except OSError:
                connections.remove(connection)


def churn(path: str) -> None:
    """Connects, hears the greeting, and leaves."""
    while True:
        with suppress(OSError):
            called(path).close()


def calls(path: str) -> None:
    """Connects and leaves, without the right to."""
    while True:
        with suppress(OSError), socket.socket(socket.AF_UNIX) as connection:
            connection.connect(path)


ATTACKS: dict[str, tuple[Attack | None, int]] = {
    "none": (None, 0), "crowd": (crowd, DAEMON), "flood": (flood, DAEMON), "garbage": (garbage, DAEMON),
    "long": (long, DAEMON), "slow": (slow, DAEMON), "churn": (churn, DAEMON), "calls": (calls, NOBODY),
}  # fmt: skip


@contextmanager
def running(folder: Path) -> Iterator[str]:
    """A run, and the path of its socket."""
    (folder / "attacked.yaml").write_text(json.dumps(RUN))
    command = [sys.executable, "-m", "llfsm_verify", "run", str(folder / "attacked.yaml"), "--whiteboard", "attacked"]
    run = subprocess.Popen(
        [*command, "--audit", str(folder / "log")], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        while True:
            assert run.poll() is None
            with suppress(WhiteboardError), Whiteboard("attacked") as board:
                board.view()
                break
            time.sleep(0.02)
        yield str(socket_path("attacked"))
    finally:
        run.send_signal(signal.SIGTERM)
        run.wait()


@contextmanager
def attacking(attack: Attack | None, uid: int, path: str, count: int) -> Iterator[None]:
    """So many processes do this."""
    pids = []
    for _ in range(count if attack is not None else 0):
        pid = os.fork()
        if not pid:
            try:
                if os.getuid() == 0:
                    os.setgroups([])
                    os.setresuid(uid, uid, uid)
                assert attack is not None
                attack(path)
            finally:
                os._exit(1)
        pids.append(pid)
    try:
        time.sleep(1)
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def told(seconds: list[float]) -> str:
    if not seconds:
        return "          -          -"
    return f"{1e3 * statistics.median(seconds):8.1f} ms{1e3 * max(seconds):8.1f} ms"


def measure(name: str, path: str, commands: int, attackers: int) -> int:
    """How many commands were not taken."""
    attack, uid = ATTACKS[name]
    kept, new, failed = list[float](), list[float](), 0
    with Whiteboard("attacked") as board, attacking(attack, uid, path, attackers):
        for number in range(commands):
            began = time.monotonic()
            try:
                board.command("write", "wish", number % 100)
                kept.append(time.monotonic() - began)
                began = time.monotonic()
                with Whiteboard("attacked") as other:
                    other.command("write", "wish", number % 100)
                new.append(time.monotonic() - began)
            except WhiteboardError:
                failed += 1
            time.sleep(0.003)
    print(f"{name:8}{told(kept)}   {told(new)}   {failed:4}", flush=True)
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(prog=f"python -m {NAME}")
    parser.add_argument("--commands", type=int, default=100)
    parser.add_argument("--attackers", type=int, default=4)
    parser.add_argument("attacks", nargs="*", default=[*ATTACKS])
    options = parser.parse_args()
    client.SECONDS = None  # it is measured how long that takes
    print(
        f"a cycle takes {CYCLE_MS} ms; {options.attackers} processes attack, and {options.commands} commands are given"
    )
    print("attack    kept: median      worst   new: median      worst   lost")
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:  # its path has to be short
        Path(folder).chmod(0o755)
        os.environ["LLFSM_WHITEBOARDS"] = folder
        with running(Path(folder)) as path:
            return sum(measure(name, path, options.commands, options.attackers) for name in options.attacks)


if __name__ == "__main__":
    sys.exit(main() > 0)
