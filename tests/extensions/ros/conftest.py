"""A ROS master on a free port, nodes beside it, and the child of a port that is driven by hand."""

from __future__ import annotations

import json
import os
import queue
import socket
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.outside import demand

PYTHON = "/usr/bin/python3"
HERE = Path(__file__).parent
NODE = HERE.parents[2] / "llfsm_verify" / "extensions" / "ros" / "ros1_node"
LIMIT = 60.0
"""Seconds after which what is waited for will not come."""
BOOL = {"low": 0, "high": 1, "boolean": True, "digits": 0, "labels": []}
NUMBER = {"low": -(10**9), "high": 10**9, "boolean": False, "digits": 0, "labels": []}
NAMES = {"low": 0, "high": 1, "boolean": False, "digits": 0, "labels": ["NONE", "START"]}


def decimal(digits: int) -> dict[str, object]:
    return {**NUMBER, "digits": digits}


def around(port: int, folder: Path) -> dict[str, str]:
    """The environment of a node whose master is there."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS"))}
    return kept | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": str(folder),
        "ROS_HOME": str(folder), "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip


class Master:
    """May be stopped and started again, at the same port."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.surroundings = around(self.port, folder)
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        start = f"import rosmaster; rosmaster.rosmaster_main(['rosmaster', '--core', '-p', '{self.port}'])"
        self.process = subprocess.Popen(
            [PYTHON, "-c", start], env=self.surroundings, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        while True:
            assert self.process.poll() is None
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            threading.Event().wait(0.02)

    def stop(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait()


class Lines:
    """Lines of JSON from a process, as they come."""

    def __init__(self, stream: Any) -> None:
        self._queue: queue.Queue[dict[str, Any]] = queue.Queue()
        self.all: list[dict[str, Any]] = []
        self._stream = stream
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._stream:
            self._queue.put(json.loads(line))
        self._queue.put({"gone": True})

    def now(self) -> Iterator[dict[str, Any]]:
        """What has come; nothing is waited for."""
        while not self._queue.empty():
            yield self._queue.get()

    def close(self) -> None:
        self._reader.join()
        self._stream.close()

    def until(self, *keys: str, **values: Any) -> dict[str, Any]:
        """The next line with these keys and values; what comes before is left out."""
        while True:
            found = self._queue.get(timeout=LIMIT)
            self.all.append(found)
            if all(key in found for key in keys) and values.items() <= found.items():
                return found
            assert "gone" not in found, self.all


class Peer:
    """`peer.py`, which does what it is told."""

    def __init__(self, surroundings: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [PYTHON, str(HERE / "peer.py")], env=surroundings, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.lines = Lines(self.process.stdout)
        self.until = self.lines.until
        self.until("ready")

    def do(self, what: str, **how: Any) -> None:
        self.begin(what, **how)
        self.until("done")

    def begin(self, what: str, **how: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps({"do": what, **how}).encode() + b"\n")
        self.process.stdin.flush()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.lines.close()
        assert self.process.stdin is not None
        self.process.stdin.close()


class Driven:
    """The child of a port, which is told what the run would tell it."""

    def __init__(self, surroundings: dict[str, str], told: dict[str, Any], **hello: Any) -> None:
        self.socket, theirs = socket.socketpair()
        self.process = subprocess.Popen(
            [PYTHON, str(NODE)], env=surroundings, stdin=theirs, stdout=theirs, start_new_session=True
        )
        theirs.close()
        self.lines = Lines(self.socket.makefile("rb"))
        self.until = self.lines.until
        self.tell(
            hello=1, port="robot", cycle_ms=10, **{"inputs": {}, "outputs": {}, "requests": {}, **hello}, told=told
        )

    def tell(self, **what: Any) -> None:
        self.socket.sendall(json.dumps(what).encode() + b"\n")

    def input(self, field: str) -> Any:
        """The next value of an input."""
        while True:
            value: Any = self.until("values")["values"]
            for part in field.split("."):
                value = value.get(part) if isinstance(value, dict) else None
            if value is not None:
                return value

    def end(self) -> None:
        self.tell(end="ended")
        assert self.process.wait(LIMIT) == 0

    def close(self) -> None:
        self.socket.shutdown(socket.SHUT_WR)  # what a run that dies leaves
        self.process.wait(LIMIT)
        self.lines.close()
        self.socket.close()


class Graph:
    """Starts nodes and children, and ends them."""

    def __init__(self, master: Master) -> None:
        self.master = master
        self._open: list[Peer | Driven] = []

    def peer(self) -> Peer:
        self._open.append(made := Peer(self.master.surroundings))
        return made

    def child(self, told: dict[str, Any] | None = None, *, greet: bool = True, **hello: Any) -> Driven:
        self._open.append(made := Driven(self.master.surroundings, told or {}, **hello))
        if greet:
            made.until("hello")
        return made

    def close(self) -> None:
        for one in self._open:
            one.close()


@pytest.fixture(scope="session")
def master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Master]:
    demand("rospy")
    made = Master(tmp_path_factory.mktemp("ros"))
    made.start()
    yield made
    made.stop()


@pytest.fixture
def graph(master: Master) -> Iterator[Graph]:
    """Beside a master that other tests use as well: names are theirs alone."""
    made = Graph(master)
    yield made
    made.close()


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[Graph]:
    """With a master of its own."""
    demand("rospy")
    master = Master(tmp_path)
    master.start()
    made = Graph(master)
    yield made
    made.close()
    master.stop()


def topic(of: str, queue: int = 1000, *, latch: bool = False) -> dict[str, Any]:
    return {"type": of, "queue": queue, "latch": latch}
