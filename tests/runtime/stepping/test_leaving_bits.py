"""What a property reads leaves 64 bits, at first or later: nothing is decided from there on."""

from __future__ import annotations

from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.deciding.frames import FrameMonitors
from llfsm_verify.runtime.live.slots import slots_of
from tests.cli.running import llfsm
from tests.runtime.live.runs import code_of, recorded

COUNTS = """\
name: counts
cycle_ms: 10
whiteboard: {n: {type: int, init: FIRST}}
machines:
  m: {inline: {machine: M, states: [{name: A, internal: n += 1;, stays: true}]}}
schedule: [m]
"""
pytestmark = pytest.mark.slow
ATOM = "n * 9223372036854775807 >= 0"
"""It leaves 64 bits where n is 2."""


@pytest.fixture(params=[2, 0], ids=["at first", "later"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    file = tmp_path / "counts.yaml"
    file.write_text(COUNTS.replace("FIRST", str(request.param)), "utf-8")
    return str(file)


@pytest.fixture
def at_first(request: pytest.FixtureRequest) -> bool:
    return "at first" in request.node.name


def test_a_simulation_ends_there(path: str, at_first: bool) -> None:
    done = llfsm("simulate", path, "--seed", "1", "--until", f"!({ATOM})", "-q")
    assert done.returncode == 4 and done.stdout.startswith("0 steps" if at_first else "2 steps")
    assert "A value left 64 bits: the executor cannot go on." in done.stdout
    assert (
        '"ending": "overflow"' in llfsm("simulate", path, "--until", ATOM.replace(">=", "<"), "--format", "json").stdout
    )


def test_a_run_with_a_monitor_ends_or_does_not_begin(path: str, at_first: bool) -> None:
    done = llfsm("run", path, "--rate", "0", "--for", "1s", "-p", f"G {ATOM}")
    if at_first:
        said = f"error[E483]: `{ATOM}` leaves 64 bits in the initial configuration, so a run cannot monitor it"
        assert done.returncode == 3 and done.stderr.startswith(f"<command line>:1:3: {said}\n")
    else:
        assert done.returncode == 4 and "a value left 64 bits\nundecided: L1" in done.stdout


def test_in_python(path: str, at_first: bool) -> None:
    model = lv.load(path)
    with pytest.raises(lv.SimulationOverflow):
        model.monitor(f"G {ATOM}").start().run(5)
    if at_first:
        with pytest.raises(lv.DiagnosticError, match="E483"):
            model.run(f"G {ATOM}", rate=0, cycles=3)


def test_a_recording_is_undecided(path: str, at_first: bool, tmp_path: Path) -> None:
    record = str(tmp_path / "r")
    assert llfsm("run", path, "--rate", "0", "--for", "1s", "--record", record).returncode == 0
    done = llfsm("check-recording", record, "-p", f"G {ATOM}", "-p", "F n == 50")
    place = f"`{ATOM}` leaves 64 bits in the initial configuration"
    place = place if at_first else "what a property reads leaves 64 bits in step 2"
    assert done.returncode == 4 and done.stdout.count("undecided") == 2 and done.stdout.count(f"because {place}") == 2


def test_frames_with_such_a_letter_are_as_frames_that_were_missed(path: str, at_first: bool, tmp_path: Path) -> None:
    arrangement = load_arrangement(path)
    code = code_of(arrangement)
    _, turns = recorded(code, tmp_path / "r", 9, 1)
    text = f"a: G {ATOM}\nb: F (n == 1 && {ATOM})\nc: F (n == 3)\n"
    monitors = FrameMonitors(arrangement, parse_properties([Source("p", text)]), slots_of(code))
    for turn in turns[:-1]:
        monitors.read(turn.frame)
    assert f"`{ATOM}` leaves 64 bits in frame " in monitors.results[0].reason
    monitors.read(turns[-1].frame)
    assert [d.verdict for d in monitors.results] == ["undecided", "undecided" if at_first else "satisfied", "undecided"]


def test_a_log_is_read_up_to_there(path: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("n\n0\n1\n2\n", "utf-8")
    (tmp_path / "map.yaml").write_text("columns: {n: n}\nended: true\n", "utf-8")
    given = str(tmp_path / "log.csv"), "--mapping", str(tmp_path / "map.yaml"), "--arrangement", path
    done = llfsm("check-recording", *given, "-p", f"G {ATOM}")
    assert done.returncode == 4 and f"because `{ATOM}` leaves 64 bits in row 3" in done.stdout


def test_a_debugger_says_it(path: str, at_first: bool) -> None:
    done = llfsm("debug", path, "--command", f"until !({ATOM})")
    assert "leaves 64 bits" in done.stdout
    assert (done.returncode, "where the run begins" in done.stdout) == ((2, True) if at_first else (0, False))
