"""What tests of ROS 2 need: a domain of DDS for each, the program of the port on a socket pair, and types."""

from __future__ import annotations

import fcntl
import json
import os
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

DOMAINS = range(20, 100)
"""Those that tests use, from which ports of UDP follow: 7400 + 250 times the number."""


@contextmanager
def free_domain() -> Iterator[int]:
    """A domain that no other test of this machine uses."""
    folder = Path(tempfile.gettempdir(), f"llfsm-domains-{os.getuid()}")
    folder.mkdir(exist_ok=True)
    for number in DOMAINS:
        with open(folder / str(number), "w") as file, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                first.bind(("127.0.0.1", 7410 + 250 * number))
            except OSError:
                continue
            first.close()
            yield number
            return
    raise AssertionError("every domain is taken")


def topics(**types: str | Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """What a port says of topics, by their names without `/`."""
    usual = {"reliability": "reliable", "durability": "volatile", "depth": 10}
    return {f"/{name}": {**usual, **({"type": of} if isinstance(of, str) else of)} for name, of in types.items()}


BOOL = {"low": 0, "high": 1, "boolean": True, "digits": 0, "labels": []}


def decimals(digits: int) -> dict[str, Any]:
    """The type of a slot."""
    return {"low": -(1 << 62), "high": 1 << 62, "boolean": False, "digits": digits, "labels": []}


class Child:
    """The program of a port of the kind `ros2`, as a run has it."""

    def __init__(
        self, domain: int | None, folder: Path, topics: Mapping[str, Any], inputs: Mapping[str, Any],
        outputs: Sequence[str] = (), **told: Any,
    ) -> None:  # fmt: skip
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-m", "llfsm_verify.extensions.ros.dds_node"]
        self.process = subprocess.Popen(command, stdin=theirs, stdout=theirs)
        theirs.close()
        self._socket, self._rest = ours, b""
        self.said: list[str] = []
        self.lost: list[str] = []
        told = {
            "domain": domain, "peers": ["127.0.0.1"], "interface": "lo", "messages": [str(folder)], "topics": topics,
            **told,
        }  # fmt: skip
        self.tell(hello=1, port="p", inputs=inputs, outputs=dict.fromkeys(outputs, BOOL), requests={}, told=told)

    def fileno(self) -> int:
        return self._socket.fileno()

    def tell(self, **line: object) -> None:
        """As a run does, read meanwhile: a program that waits until it is read would not read either."""
        data = json.dumps(line).encode() + b"\n"
        while data:
            reads, writes, _ = select.select([self._socket], [self._socket], [])
            if reads:
                self._rest += self._received()
            if writes:
                with suppress(BlockingIOError):
                    data = data[self._socket.send(data, socket.MSG_DONTWAIT) :]

    def _received(self) -> bytes:
        data = self._socket.recv(1 << 16)
        assert data, f"the program has ended, and said {self.said}"
        return data

    def line(self) -> dict[str, Any]:
        """The next line; what it says and what is lost is kept."""
        while b"\n" not in self._rest:
            self._rest += self._received()
        text, _, self._rest = self._rest.partition(b"\n")
        found: dict[str, Any] = json.loads(text)
        self.said += [found["say"]] if "say" in found else []
        self.lost += [found["why"]] if "lost" in found else []
        return found

    def has_said(self, patience: float = 0) -> bool:
        """Whether `line` would not wait, perhaps after these seconds."""
        return b"\n" in self._rest or bool(select.select([self._socket], [], [], patience)[0])

    def until(self, key: str) -> dict[str, Any]:
        """The next line with this key."""
        while key not in (found := self.line()):
            continue
        return found

    def values(self) -> dict[str, Any]:
        """Of the next message."""
        found: dict[str, Any] = self.until("values")["values"]
        return found

    def upto(self, values: Mapping[str, Any]) -> list[dict[str, Any]]:
        """The messages until this one comes, and it."""
        found = [self.values()]
        while found[-1] != values:
            found.append(self.values())
        return found

    def close(self) -> int:
        """The exit code, after the run has ended."""
        self.tell(end="stopped")
        self._socket.shutdown(socket.SHUT_WR)
        code = self.process.wait()
        self._socket.close()
        return code

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self._socket.close()


@contextmanager
def child(*args: Any, **told: Any) -> Iterator[Child]:
    made = Child(*args, **told)
    try:
        assert made.line() == {"hello": 1}, made.said
        yield made
        assert made.close() == 0
    finally:
        if made.process.poll() is None:
            made.kill()


def connect(reads: Child, writes: Child, values: Mapping[str, Any]) -> dict[str, Any]:
    """What is first read of each topic, which is said again until each side knows the other."""
    found: dict[str, Any] = {}
    while values.keys() - found:
        writes.tell(values=values)
        while reads.has_said(0.05):
            found = {**reads.line().get("values", {}), **found}
    return found


STANDARD = {
    "std_msgs/msg/Bool.msg": "bool data\n",
    "std_msgs/msg/Header.msg": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/msg/Time.msg": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/msg/Vector3.msg": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/msg/Twist.msg": "Vector3  linear\nVector3  angular\n",
    "sensor_msgs/msg/LaserScan.msg": "std_msgs/Header header # of the first ray\nfloat32 angle_min\nfloat32[] ranges\n",
}


def write_types(folder: Path, types: Mapping[str, str] = STANDARD) -> Path:
    for name, text in types.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder
