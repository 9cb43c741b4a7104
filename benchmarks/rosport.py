"""From one topic of ROS 1 to another through a machine, beside a relay that is written with rospy, in one run.

`python -m benchmarks.rosport [SECONDS]`: a node publishes numbers and takes the time until each is back. In between is
a rospy node that publishes what it hears, or `llfsm run` with a port `ros1`, whose machine copies the input.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.ros import PEER, PYTHON, NoRos, master

COPY = """\
name: copy
cycle_ms: {cycle}
whiteboard:
  heard: {{type: int64, init: 0, role: input}}
  told: {{type: int64, init: 0, role: output}}
machines:
  relay: {{inline: {{machine: Relay, states: [{{name: S, internal: told = heard;, stays: true}}]}}}}
schedule: [relay]
"""
PORTS = """\
ports:
  ros:
    kind: ros1
    topics: {/llfsm_in: std_msgs/Int64, /llfsm_out: std_msgs/Int64}
    inputs: {heard: /llfsm_in.data}
    outputs: {told: /llfsm_out.data}
    on_failure: stale
"""
PAUSE_MS = 20
"""Between two numbers."""


def measured(command: list[str], surroundings: dict[str, str], times: int) -> tuple[list[int], float]:
    """Nanoseconds of each number while a program is in between, and its share of a processor."""
    between = subprocess.Popen(command, env=surroundings, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        peer = [PYTHON, str(PEER), "there-and-back", str(times)]
        with subprocess.Popen(peer, env=surroundings, stdout=subprocess.PIPE, text=True) as clock:
            assert clock.stdout is not None
            clock.stdout.readline()  # the first numbers are back
            before = sum(map(_ticks, _family(between.pid)))
            seconds, *found = clock.stdout.readline().split()
            ticks = sum(map(_ticks, _family(between.pid))) - before
        return [int(one) for one in found], ticks / os.sysconf("SC_CLK_TCK") / float(seconds)
    finally:
        between.terminate()
        between.wait()


def _family(pid: int) -> list[int]:
    below = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [pid, *(one for child in below for one in _family(int(child)))]


def _ticks(pid: int) -> int:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def _row(name: str, found: list[int], share: float) -> str:
    found = sorted(found)
    middle, late = (found[int(len(found) * part)] / 1e6 for part in (0.5, 0.99))
    return f"{name:24} {middle:8.2f} ms {late:8.2f} ms {100 * share:8.1f} %"


def main(seconds: float) -> None:
    times = int(seconds * 1000 / PAUSE_MS)
    print(f"{'between two topics':24} {'50 %':>11} {'99 %':>11} {'processor':>10}   ({times} numbers)")
    with master() as surroundings, tempfile.TemporaryDirectory() as folder:
        relay = [PYTHON, str(PEER), "copy", "0"]
        print(_row("rospy relay", *measured(relay, surroundings, times)), flush=True)
        Path(folder, "ros.ports.yaml").write_text(PORTS)
        for cycle in (1, 10):
            Path(folder, "copy.yaml").write_text(COPY.format(cycle=cycle))
            run = [sys.executable, "-m", "llfsm_verify", "run", "copy.yaml", "--ports", "ros.ports.yaml"]
            command = ["env", "-C", folder, f"PYTHONPATH={Path(__file__).parents[1]}", *run]
            print(_row(f"machine, {cycle} ms a cycle", *measured(command, surroundings, times)), flush=True)
        print(_row("rospy relay, again", *measured(relay, surroundings, times)))


if __name__ == "__main__":
    try:
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
    except NoRos as reason:
        sys.exit(str(reason))
