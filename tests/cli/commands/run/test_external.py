"""A run whose clock is a program: the Komodo robot in a Python world, and worlds that die, hang or count wrongly;
machines are replaced meanwhile."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.replay import CLOCKED
from tests.api.test_changing_runs import TEXTS
from tests.cli.running import LIGHTS, llfsm
from tests.processes import ended
from tests.runtime.live.runs import turns_of

KOMODO, LINES = "models/komodo_stroll/arrangement.yaml", "properties/komodo_stroll.ltl"
WORLD = "examples/python_world/world.ports.yaml"
PORT = "{{kind: process, run: [{python}, world.py, {how}], clock: {clock}, inputs: [car], on_failure: {failing}}}"
SCRIPT = """\
import json, os, sys, time
told = json.loads(sys.stdin.readline())
cycle = told["cycle"]
print('{"hello": 1}', flush=True)
while True:
    if cycle == 10 and sys.argv[1] == "die" and not os.path.exists("died"):
        open("died", "w").close()
        os.kill(os.getpid(), 9)
    if cycle == 10 and sys.argv[1] == "hang":
        print("it hangs", file=sys.stderr, flush=True)
        time.sleep(1000)
    if sys.argv[1] == "wrong":
        print(json.dumps({"cycle": cycle + 7, "values": {"car": True}}), flush=True)
        print(json.dumps({"cycle": "x", "values": {"car": True}}), flush=True)
    print(json.dumps({"cycle": cycle, "values": {"car": cycle % 3 == 0}}), flush=True)
    while (frame := json.loads(sys.stdin.readline())).get("cycle") != cycle:
        if "end" in frame:
            sys.exit()
    if sys.argv[1] == "log":
        with open("log", "a") as log:
            print(cycle, frame["values"]["out"], file=log)
    cycle += 1
"""


def ports(folder: Path, how: str, *, clock: str = "external", failing: str = "stale", more: str = "") -> str:
    (folder / "world.py").write_text(SCRIPT)
    path = folder / "test.ports.yaml"
    port = PORT.format(python=sys.executable, how=how, clock=clock, failing=failing)
    path.write_text(f"ports:\n  world: {port}\n{more}")
    return str(path)


def started(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "llfsm_verify", "run", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_two_runs_in_a_python_world_are_the_same_but_for_times(tmp_path: Path) -> None:
    found = []
    for name in ("a", "b"):
        path = tmp_path / name
        process = started(KOMODO, "--ports", WORLD, "--for", "60s", "--record", str(path))
        output, errors = ended(process)
        assert process.returncode == 0, errors
        assert output.startswith("240 cycles (240 ringlets), 60 s of logical time, in ")
        assert "\nthe clock was external: a port began each cycle\n" in output and "lateness" not in output
        assert "port world: 240 messages in" in output
        turns = turns_of(path)
        found.append(([[w for n, w in enumerate(turn.frame) if n not in CLOCKED] for turn in turns], errors))
    assert found[0] == found[1] and len(found[0][0]) == 242
    assert "the robot has walked " in found[0][1] and " in 60 s, " in found[0][1]
    again = llfsm("replay", str(path))
    assert again.stdout.splitlines() == [
        "note: its clock was external: a port began each cycle",
        f"{path}: 242 frames, the same bit for bit, and then stopped",
    ]
    assert "violated" not in llfsm("check-recording", str(path), LINES).stdout
    checked = llfsm("check-recording", str(path), "-p", "F motion == BACKWARD")
    assert checked.returncode == 0 and checked.stdout.startswith("satisfied"), checked.stdout


@pytest.mark.slow
def test_a_world_that_dies_is_waited_for_or_ends_the_run(tmp_path: Path) -> None:
    path = tmp_path / "recording"
    process = started(LIGHTS, "--ports", ports(tmp_path, "die"), "--for", "40s", "--record", str(path))
    output, errors = ended(process)
    assert process.returncode == 0 and output.startswith("40 cycles "), (output, errors)
    given = [turn.frame for turn in turns_of(path)]
    assert len(given) == 42 and "port world: SIGKILL has ended it: " in errors
    (tmp_path / "died").unlink()
    process = started(LIGHTS, "--ports", ports(tmp_path, "die", failing="stop"))
    output, errors = ended(process)
    assert process.returncode == 1 and output.startswith("10 cycles "), (output, errors)
    assert ": stopped: port world: " in output
    (tmp_path / "died").unlink()
    process = started(LIGHTS, "--ports", ports(tmp_path, "die", failing="stale, restart: false"))
    output, errors = ended(process)
    assert process.returncode == 1 and "SIGKILL has ended it, so no cycle can begin" in output, (output, errors)


@pytest.mark.slow
def test_a_world_that_hangs_or_counts_wrongly(tmp_path: Path) -> None:
    process = started(LIGHTS, "--ports", ports(tmp_path, "hang"))
    assert process.stderr is not None and process.stderr.readline() == "it hangs\n"
    process.send_signal(signal.SIGINT)
    output, errors = ended(process)
    assert process.returncode == 0 and output.startswith("10 cycles "), (output, errors)
    process = started(LIGHTS, "--ports", ports(tmp_path, "wrong"), "--for", "5s")
    output, errors = ended(process)
    assert process.returncode == 0 and output.startswith("5 cycles "), (output, errors)
    assert "port world: cycle 7 cannot begin where cycle 0 is the next one\n" in errors
    assert re.search(r"\b1[0-2] malformed", output), "the end may come before it is told of the last two"


@pytest.mark.slow
def test_what_does_not_go_with_an_external_clock(tmp_path: Path) -> None:
    for option, value in (("--rate", "2"), ("--jitter", "5ms"), ("--on-overrun", "stop")):
        done = llfsm("run", LIGHTS, "--ports", ports(tmp_path, "ok"), option, value)
        assert done.returncode == 2
        assert " is about real time, and port `world` begins each cycle (`clock: external`)" in done.stderr
    for options in ({"rate": 2}, {"stop_on": ["overrun"]}):
        with pytest.raises(ValueError, match="about real time, and a port begins each cycle"):
            lv.load(LIGHTS).run(ports=ports(tmp_path, "ok"), **options)  # type: ignore[arg-type]
    done = llfsm("run", LIGHTS, "--ports", ports(tmp_path, "ok", clock="extern"))
    assert done.returncode == 3 and "error[E035]: `clock` of port `world` cannot be `extern`" in done.stderr
    other = "  b: {kind: process, run: x, clock: external, outputs: [ns_light]}\n"
    done = llfsm("run", LIGHTS, "--ports", ports(tmp_path, "ok", more=other))
    assert done.returncode == 3 and "error[E494]: two ports begin the cycles of the run" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("processes", ["thread", "separate"])
def test_a_machine_is_replaced_between_two_cycles(tmp_path: Path, processes: str) -> None:
    for name, text in TEXTS.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "world.py").write_text(SCRIPT)
    port = PORT.format(python=sys.executable, how="log", clock="external", failing="stop").replace("[car]", "{go: car}")
    (tmp_path / "p.yaml").write_text(f"ports:\n  world: {port.replace('inputs', 'outputs: [out], inputs')}\n")
    path, log = tmp_path / "r", tmp_path / "log"
    with lv.load(tmp_path / "a.yaml").run(record=path, processes=processes, ports=tmp_path / "p.yaml") as run:
        while not log.exists() or log.read_text().count("\n") < 20:
            time.sleep(0.001)
        run.replace("count", tmp_path / "down.yaml", unchecked=True)
        before = log.read_text().count("\n")
        while log.read_text().count("\n") < before + 20:
            time.sleep(0.001)
    assert run.wait().external and run.wait().lateness is None
    rows = [tuple(map(int, line.split())) for line in log.read_text().splitlines()]
    assert [cycle for cycle, _ in rows] == [*range(len(rows))]
    changes = [(later - out) % 10 for (_, out), (_, later) in pairwise(rows)]
    assert changes == sorted(changes) and {*changes} == {1, 9}, "up, then down, and no cycle twice or left out"
    for file in (path, tmp_path / "r.2"):
        assert "the same bit for bit" in llfsm("replay", str(file)).stdout
        with Recording(file) as recording:
            assert recording.header["clock"] == "external"
