"""`llfsm debug` from the command line: what it debugs, scripts, exit codes, and what runs."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from llfsm_verify.extensions.debugger.commands import COMMANDS
from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError
from tests.cli.running import FAULTY, LIGHTS, llfsm


def commands(*lines: str) -> list[str]:
    return [word for line in lines for word in ("--command", line)]


@pytest.mark.slow
def test_a_script_is_as_good_as_commands(tmp_path: Path) -> None:
    lines = ["# to where east-west has its turn", "set car true", "", "until ew@GREEN", "why"]
    script = tmp_path / "script"
    script.write_text("\n".join(lines))
    given = llfsm("debug", LIGHTS, *commands(*lines))
    assert given.returncode == 0 and "turn = true, other@RED = true" in given.stdout
    assert llfsm("debug", LIGHTS, "--script", str(script)).stdout == given.stdout
    assert llfsm("debug", LIGHTS, "--script", "-", stdin="\n".join(lines)).stdout == given.stdout
    assert llfsm("debug", LIGHTS, stdin="\n".join(lines)).stdout == given.stdout


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (("step", "quit", "jump"), 0),
        (("step", "expect ns@RED", "step", "expect ns@RED", "step"), 1),
        (("step", "jump", "step"), 2),
    ],
)
def test_exit_codes(lines: tuple[str, ...], code: int) -> None:
    assert llfsm("debug", LIGHTS, *commands(*lines)).returncode == code


def test_what_is_not_there_is_a_diagnostic(tmp_path: Path) -> None:
    absent = llfsm("debug", "lights", *commands("step"))
    assert absent.returncode == 3 and "E486" in absent.stderr
    absent = llfsm("debug", str(tmp_path / "lights.yaml"), *commands("step"))
    assert absent.returncode == 3 and "E001" in absent.stderr
    assert llfsm("debug", "-", "--script", "-").returncode == 2


@pytest.mark.slow
def test_a_trace_is_walked_to_what_it_shows(tmp_path: Path) -> None:
    formula = "G !(ns@GREEN && ew@GREEN)"
    llfsm("verify", FAULTY, "-p", f"both: {formula}", "--save-traces", str(tmp_path))
    lines = ("until ns@GREEN && ew@GREEN", f"value {formula}", "continue", "reverse", "set car true")
    done = llfsm("debug", str(tmp_path / "both.trace.yaml"), *commands(*lines))
    assert f"{formula}: violated" in done.stdout
    assert "The trace ends here." in done.stdout and "This is the beginning." in done.stdout
    assert "this trace has happened" in done.stdout and done.returncode == 2


@pytest.mark.slow
def test_a_recording_is_walked_as_it_was(tmp_path: Path) -> None:
    path = str(tmp_path / "lights.recording")
    llfsm("run", LIGHTS, "--simulate", "--seed", "1", "--for", "30s", "--rate", "0", "--record", path)
    timeline = llfsm("trace", path, "--to", "csv").stdout.splitlines()
    titles = timeline[0].split(",")
    rows = {int(cells[0]): dict(zip(titles, cells, strict=True)) for cells in (r.split(",") for r in timeline[1:])}
    done = llfsm("debug", path, *commands("cycle", "cycle 5", "back 4", "cycle 20", "back-cycle 3", "continue"))
    assert done.returncode == 0 and "The recording ends here: stopped." in done.stdout
    places = [line for line in done.stdout.splitlines() if line.startswith("at step ")]
    assert len(places) == 6
    seen = 0
    for place in places:
        step = int(place.split()[2].rstrip(","))
        if step in rows:  # where a frame ends
            row = rows[step]
            states = f"timer@{row['timer']} ns@{row['ns']} ew@{row['ew']}"
            assert place.endswith(states)
            seen += 1
    assert seen == 5


def called(name: str, server: subprocess.Popen[bytes]) -> Whiteboard:
    """The whiteboard of a run, as soon as it is there."""
    while True:
        try:
            return Whiteboard(name)
        except WhiteboardError:
            assert server.poll() is None, "the run has ended"
            time.sleep(0.01)


@pytest.mark.slow
def test_attached_it_only_looks(tmp_path: Path) -> None:
    name = f"debugged-{os.getpid()}"
    run = [sys.executable, "-m", "llfsm_verify", "run", LIGHTS, "--simulate", "--seed", "2", "--rate", "200"]
    with subprocess.Popen([*run, "--whiteboard", name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        try:
            with called(name, server):
                lines = ("step 2", "until ns@AMBER", "back", "step", "expect ns@AMBER", "until x > 3")
                done = llfsm("debug", name, *commands(*lines))
                assert done.returncode == 2
                assert "`ns@AMBER` is true." in done.stdout and "ns@AMBER: true" in done.stdout
                assert "not `x > 3`" in done.stdout
                for line in ("set car true", "fork", "turn main", "free car"):
                    refused = llfsm("debug", name, *commands(line))
                    assert refused.returncode == 2 and "would change the run" in refused.stdout
                assert "needs the steps of the run" in llfsm("debug", name, *commands("why")).stdout
        finally:
            server.terminate()


def test_the_page_has_all_commands() -> None:
    page = Path("docs/debugging.md").read_text(encoding="utf-8")
    table = "\n".join(f"| `{c.usage}` | `{c.short}` | {c.about} |" for c in COMMANDS)
    assert table in page
