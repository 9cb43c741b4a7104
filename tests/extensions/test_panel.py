"""The panel of a run."""

from __future__ import annotations

import os
import subprocess
import sys
import termios
from contextlib import suppress
from dataclasses import replace

import pytest

from llfsm_verify.extensions.terminal.panel import Snapshot, panel
from llfsm_verify.report.plain import plain_text
from llfsm_verify.runtime.live.run import Lateness
from tests.cli.running import LIGHTS, llfsm

LATE = Lateness(7, ((50.0, 1_500), (99.0, 20_000_000)), 20_500_000, 2, 0)
NOW = Snapshot(
    "lights", 12, "running", 3.5, 36, 10.4, {"ns": "GREEN", "ew": "RED"}, {"car": True, "n": 3},
    {"safe": "violated", "live": "undecided", "fair": "undecided"}, LATE,
)  # fmt: skip


def test_what_it_shows() -> None:
    assert (
        plain_text([panel(NOW, {}, 40)], 100)
        == """\
╭─ lights: runs ─────────────────────────────────────────────────────────────╮
│ frame 12   3.500 s of logical time   36 ringlets                           │
│ 10 ringlets a second                                                       │
│ lateness: 50 % within 1.5 µs, 99 % within 20 ms, worst 20.5 ms, overruns 2 │
│ properties: 1 violated, 2 undecided                                        │
│ violated: safe                                                             │
│                                                                            │
│ machine  state       slot  value                                           │
│ ns       GREEN       car   true                                            │
│ ew       RED         n     3                                               │
╰────────────────────────────────────────────────────────────────────────────╯
"""
    )


def test_it_fits_a_terminal() -> None:
    many = replace(NOW, values={f"v{number}": number for number in range(100)})
    lines = plain_text([panel(many, {}, 24)], 100).splitlines()
    assert len(lines) <= 24 and any("more" in line for line in lines)
    over = plain_text([panel(replace(many, ending="fault", lateness=None, verdicts={}), {}, 5)], 100)
    assert "… 97 more" in over


@pytest.mark.slow
def test_a_panel_is_for_terminals() -> None:
    done = llfsm("run", LIGHTS, "--panel")
    assert (done.returncode, done.stderr) == (2, "error: --panel needs a terminal as standard output\n")


@pytest.mark.slow
def test_a_run_in_a_terminal() -> None:
    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (30, 120))
    given = ["run", LIGHTS, "--simulate", "--seed", "1", "--for", "20s", "--rate", "100", "--panel"]
    with subprocess.Popen([sys.executable, "-m", "llfsm_verify", *given], stdout=theirs, stderr=theirs) as run:
        os.close(theirs)
        said = b""
        with suppress(OSError):  # nobody holds the other end any more
            while more := os.read(ours, 1 << 16):
                said += more
    os.close(ours)
    assert run.returncode == 0
    text = said.decode()
    assert "traffic_lights: runs" in text and "traffic_lights: stopped" in text and "20 cycles (60 ringlets)" in text
