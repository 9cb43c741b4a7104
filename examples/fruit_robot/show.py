"""Runs the robot with a ROS master and its nodes, and says how that went. Nothing has to be built.

    python examples/fruit_robot/show.py                      # 60 s at 100 Hz
    python examples/fruit_robot/show.py --seconds 5 --record robot.rec
    python examples/fruit_robot/show.py --then 3             # until the third fruit after the pause
    python examples/fruit_robot/show.py --states             # the states in Python, by a transition file of CROPS

It starts a master on a free port, unless ROS_MASTER_URI is set, and ends it and the nodes by their ids. The recording
is replayed, and compared with the plants and the properties that were verified.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import itertools
import os
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import llfsm_verify as lv

HERE = Path(__file__).resolve().parent
PACKAGE = Path(lv.__file__).parent / "extensions" / "ros"
PYTHON = "/usr/bin/python3"
LLFSM = (sys.executable, "-m", "llfsm_verify")
NODES = ("localisation", "arm", "user", "error_handler")
FOUND = (str(Path(lv.__file__).parents[1]), sysconfig.get_path("purelib"))
"""Where a Python of the same version finds this package and what it needs."""
PATIENCE = 60.0
"""Seconds after which something will not come."""


def main() -> int:
    """The exit code: 0, if the recording is what was verified."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long it runs (60)")
    parser.add_argument("--drops", type=int, default=9, help="which fruit is dropped, so that the state is set (9)")
    parser.add_argument("--pause-after", type=int, default=4, help="after how many more fruits it is paused (4)")
    parser.add_argument("--then", type=int, help="end after so many more fruits, instead of `--seconds`")
    parser.add_argument(
        "--states",
        type=int,
        nargs="?",
        const=12,
        metavar="FRUITS",
        help="run `states.py` until so many are picked (12)",
    )
    parser.add_argument("--record", type=Path, help="where the recording is kept")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that nodes are ended
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as open_ones:
        around = open_ones.enter_context(surroundings(Path(folder)))
        recording = given.record or Path(folder, "robot.rec")
        board = f"fruit_robot_{os.getpid()}"
        told = {
            "arm": (f"_drops:={given.drops}",),
            "user": (f"_pause_after:={given.pause_after}", f"_then:={given.then or 0}"),
            "error_handler": (f"_whiteboard:={board}", f"_llfsm:={llfsm_in(Path(folder))}"),
        }
        names = NODES if given.states is None else NODES[:-1]  # `states.py` changes the state itself
        nodes = [open_ones.enter_context(child(node_of(node, told.get(node, ())), around)) for node in names]
        if given.states is not None:
            with_ours = around | {"PYTHONPATH": os.pathsep.join(FOUND)}
            done = subprocess.run((*states_to(given.states), str(recording)), env=with_ours, check=False)
            return done.returncode or subprocess.run((*LLFSM, "replay", str(recording)), check=False).returncode
        ends = () if given.then else ("--for", f"{round(given.seconds * 1000)}ms")
        run = subprocess.Popen(
            (*LLFSM, "run", str(HERE / "arrangement.yaml"), "--ports", str(HERE / "ports.yaml"), "--whiteboard", board,
             "--record", str(recording), *ends),
            env=around,
        )  # fmt: skip
        try:
            if given.then:
                wait_for_user(nodes[NODES.index("user")], run)
                run.send_signal(signal.SIGINT)
            code = run.wait()
        finally:
            run.kill()
            run.wait()
        return code or judge(recording)


@contextlib.contextmanager
def surroundings(folder: Path) -> Iterator[dict[str, str]]:
    """The environment of nodes, with the master that it names."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    if "ROS_MASTER_URI" in kept:
        yield kept
        return
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    kept |= {
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": str(folder),
        "ROS_HOME": str(folder),
    }  # fmt: skip
    start = f"import rosmaster; rosmaster.rosmaster_main(['rosmaster', '--core', '-p', '{port}'])"
    with child((PYTHON, "-c", start), kept) as master:
        limit = time.monotonic() + PATIENCE
        while master.poll() is None and time.monotonic() < limit:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    yield kept
                    return
            time.sleep(0.02)
        raise SystemExit("there is no ROS master")


@contextlib.contextmanager
def child(command: tuple[str, ...], around: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """A process that is ended by its id."""
    process = subprocess.Popen(command, env=around, stdout=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def node_of(name: str, told: tuple[str, ...]) -> tuple[str, ...]:
    """The command line of a node."""
    return (PYTHON, str(HERE / "unbuilt.py"), str(PACKAGE), str(HERE / "scripts" / f"{name}.py"), *told)


def states_to(fruits: int) -> tuple[str, ...]:
    """The command line of `states.py`, which needs rospy and this package at once."""
    asked = subprocess.run((PYTHON, "-c", "import sys; print(sys.version_info[:2])"), capture_output=True, check=True)
    if asked.stdout.decode().strip() != str(sys.version_info[:2]):
        raise SystemExit(f"{PYTHON} is of another version of Python than {sys.executable}")
    return (PYTHON, str(HERE / "unbuilt.py"), str(PACKAGE), str(HERE / "states.py"), str(fruits))


def llfsm_in(folder: Path) -> Path:
    """A program `llfsm` for nodes, which run under another Python."""
    path = folder / "llfsm"
    path.write_text(f'#!/bin/sh\nexec {" ".join(LLFSM)} "$@"\n', encoding="utf-8")
    path.chmod(0o755)
    return path


def wait_for_user(user: subprocess.Popen[bytes], run: subprocess.Popen[bytes]) -> None:
    """Return when the user has seen enough, or the run has ended."""
    while user.poll() is None and run.poll() is None:
        time.sleep(0.02)


def judge(recording: Path) -> int:
    """Say what the robot did, replay the recording, and compare it with plants and properties."""
    count(recording)
    done = subprocess.run((*LLFSM, "replay", str(recording)), check=False).returncode
    checked = (*LLFSM, "check-recording", str(recording))
    done = done or subprocess.run(checked, check=False).returncode
    return done or subprocess.run((*checked, str(HERE / "properties.ltl"), "--allow-undecided"), check=False).returncode


def count(recording: Path) -> None:
    """Print what the recording shows, cycle by cycle."""
    done = subprocess.run((*LLFSM, "trace", str(recording), "--to", "csv"), check=True, capture_output=True, text=True)
    seen: Counter[str] = Counter()
    rows = list(csv.DictReader(done.stdout.splitlines()))
    for before, row in itertools.pairwise(rows):
        seen[f"{before['picker']} → {row['picker']}"] += before["picker"] != row["picker"]
        for slot in ("located", "reached", "pause"):
            seen[f"{slot} {row[slot]}"] += before[slot] != row[slot]
    print(
        f"images {seen['located DONE']}, without an answer {seen['located FAILED']}; "
        f"goals {seen['reached PENDING']}, gripped {seen['Pick_fruit → Fruit_to_basket']}, "
        f"out of reach {seen['Pick_fruit → Select_fruit']}, to the basket {seen['Fruit_to_basket → Select_fruit']}; "
        f"pauses {seen['pause true']}, changes of state {seen['Fruit_to_basket → Locate_fruits']}",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
