"""ROS 1 as a peer: a master of our own, and what rospy takes to publish and to deliver."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PYTHON = "/usr/bin/python3"
PEER = Path(__file__).with_name("rospeer.py")
SECONDS = 60.0


class NoRos(Exception):
    """ROS cannot be measured here; the message says why."""


def missing() -> str | None:
    """Why ROS is not there; None: it is."""
    try:
        done = subprocess.run([PYTHON, "-c", "import rospy, rosmaster, std_msgs.msg"], capture_output=True, check=False)
    except OSError as error:
        return f"{PYTHON}: {error.strerror}"
    return None if done.returncode == 0 else "rospy is not installed (on Debian: python3-rospy python3-rosmaster)"


@contextmanager
def master() -> Iterator[dict[str, str]]:
    """A master on a free port; the environment in which nodes find it. Raises NoRos."""
    why = missing()
    if why is not None:
        raise NoRos(why)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    surroundings = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    surroundings |= {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": "/tmp"}
    start = f"import rosmaster; rosmaster.rosmaster_main(['rosmaster', '--core', '-p', '{port}'])"
    process = subprocess.Popen(
        [PYTHON, "-c", start], env=surroundings, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        until = time.monotonic() + SECONDS
        while not _answers(port):
            if process.poll() is not None or time.monotonic() > until:
                raise NoRos("rosmaster does not start")
            time.sleep(0.05)
        yield surroundings
    finally:
        process.terminate()
        try:
            process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def publish(surroundings: dict[str, str], times: int) -> float:
    """Seconds of one `publish` with a subscriber in another process."""
    return float(_peer(surroundings, "publish", times))


def latency(surroundings: dict[str, str], times: int, *, relayed: bool = False) -> list[int]:
    """Nanoseconds from before each `publish` to the subscriber's call-back; `relayed`: by way of a node that looks at
    each message."""
    what = "relayed" if relayed else "latency"
    return [int(number) for number in _peer(surroundings, what, times).split()]


def _peer(surroundings: dict[str, str], what: str, times: int) -> str:
    command = [PYTHON, str(PEER), what, str(times)]
    process = subprocess.Popen(
        command, env=surroundings, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    )
    try:
        told, _ = process.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # with the subscriber that it started
        process.communicate()
        raise NoRos(f"rospy takes more than {SECONDS:g} seconds") from None
    if process.returncode:
        raise NoRos(f"rospy failed: {process.returncode}")
    return told
