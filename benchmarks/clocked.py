"""Cycles a second of a run whose clock is a Python world (`clock: external`), beside the same world without us.

    python -m benchmarks.clocked 20000

Three ways take turns, with `examples/python_world/world.py` each time: `llfsm run`; a parent of 20 lines that answers
each line with the same frame, without a machine; and the world's step in a loop, in one process. Processor time is that
of all processes of the way. Best of three, or of as many as are wanted.
"""

from __future__ import annotations

import json
import random
import resource
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "examples" / "python_world"
KOMODO = FOLDER.parents[1] / "models" / "komodo_stroll" / "arrangement.yaml"
CYCLE_MS = 250


def through_a_run(cycles: int) -> float:
    """Seconds, as the run reports them: without its start."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "llfsm_verify",
            "run",
            str(KOMODO),
            "--ports",
            str(FOLDER / "world.ports.yaml"),
        ]
        more = ["--for", f"{cycles * CYCLE_MS}ms", "--record", f"{folder}/a.rec"]
        done = subprocess.run([*command, *more], check=True, capture_output=True, text=True)
    first = done.stdout.splitlines()[0]
    assert first.startswith(f"{cycles:,} cycle"), first
    return float(first.partition(", in ")[2].partition(" s")[0])


def through_a_socket(cycles: int) -> float:
    """Each line of the world is answered with a frame."""
    ours, theirs = socket.socketpair()
    with subprocess.Popen(["python3", "world.py"], cwd=FOLDER, stdin=theirs, stdout=theirs, stderr=-3) as child:
        theirs.close()
        with ours, ours.makefile("rw") as lines:
            print(json.dumps({"hello": 1, "cycle": 0, "cycle_ms": CYCLE_MS}), file=lines, flush=True)
            lines.readline()
            begin = time.perf_counter()
            for number in range(cycles):
                json.loads(lines.readline())
                frame = {"values": {"motion": "FORWARD"}, "time": time.monotonic(), "cycle": number}
                print(json.dumps(frame), file=lines, flush=True)
            took = time.perf_counter() - begin
            print('{"end": "stopped"}', file=lines, flush=True)
            child.wait()
    return took


def alone(cycles: int) -> float:
    """The step of the world, and its dice."""
    sys.path.insert(0, str(FOLDER))
    import world as of  # type: ignore[import-not-found]

    world = of.World(random.Random(1))
    begin = time.perf_counter()
    for _ in range(cycles):
        world.dice.randint(1, 2)
        world.step("FORWARD", CYCLE_MS / 1000)
    return time.perf_counter() - begin


def used() -> float:
    """Seconds of processor time of this process and of those that have ended."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def measured(way: Callable[[int], float], cycles: int) -> tuple[float, float]:
    """Microseconds of a cycle, and of processor time: the difference to a run of one cycle, which pays the start."""
    way(1)  # what is only done once in a process
    begin = used()
    way(1)
    middle = used()
    seconds = way(cycles)
    return 1e6 * seconds / cycles, 1e6 * (used() - middle - (middle - begin)) / cycles


def main(cycles: str = "20000", repeat: str = "3") -> None:
    """Print a line for each way."""
    found: dict[str, list[tuple[float, float]]] = {}
    for _ in range(int(repeat)):
        for way in (through_a_run, through_a_socket, alone):
            found.setdefault(way.__name__, []).append(measured(way, int(cycles)))
    for name, results in found.items():
        took, work = (min(column) for column in zip(*results, strict=True))
        print(
            f"{name.replace('_', ' '):17} {1e6 / took:10,.0f} cycles a second {work:8.1f} µs of processor time a cycle"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
