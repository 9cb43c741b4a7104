"""The examples run, and print what they should."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from llfsm_verify.cli import main
from tests.outside import needs

FOLDER = Path(__file__).parents[2] / "examples"
OF_THEIR_OWN = {"batman", "guards", "komodo_arm", "komodo_region", "traffic_takeover"}
"""Examples with a test below."""


def run(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(path), *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, cwd=FOLDER.parent)


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", [p for p in sorted(FOLDER.glob("*.py")) if p.stem not in OF_THEIR_OWN], ids=lambda p: p.stem
)
def test_example_runs(path: Path, tmp_path: Path) -> None:
    done = run(path, str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.slow
def test_the_traffic_lights_example_tells_what_it_found() -> None:
    done = run(FOLDER / "traffic_lights.py")
    assert "13 of 13 properties hold on 185 configurations" in done.stdout
    assert "the timer is in CAR_WAITING" in done.stdout


@pytest.mark.long
def test_the_robot_stays_in_its_region_with_a_guard(tmp_path: Path) -> None:
    done = run(FOLDER / "komodo_region.py", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert "3 of 3 runs leave the region" in done.stdout and "0 of 3 runs leave the region" in done.stdout
    assert (tmp_path / "komodo_region.svg").read_text().startswith("<svg")


@pytest.mark.long
def test_the_wheels_are_slow_enough_for_the_arm() -> None:
    done = run(FOLDER / "komodo_arm.py")
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("the wheels are too fast for the arm 0 times\n")


@pytest.mark.long
def test_the_takeover_has_the_times_of_the_paper(tmp_path: Path) -> None:
    done = run(FOLDER / "traffic_takeover.py", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert "the lights show AMBER and AMBER" in done.stdout and "21 s later" in done.stdout
    assert "<svg" in (tmp_path / "traffic_takeover.svg").read_text()


@pytest.mark.long
@pytest.mark.parametrize(
    ("case", "requirement", "files", "violated"),
    [("microwave", "R5_stops_cooking", 8, {"faulty_R5"}), ("xray", "door_stops", 3, {"faulty_door"})],
)
def test_every_faulty_machine_is_kept_by_a_guard(case: str, requirement: str, files: int, violated: set[str]) -> None:
    done = run(FOLDER / "guards.py", case, requirement)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == files and all(line.endswith("guarded: proved, not violated") for line in lines)
    assert {line.split()[0] for line in lines if f"{requirement}: violated" in line} >= violated


@pytest.mark.long
def test_behaviours_die_and_the_robot_stays_safe(tmp_path: Path) -> None:
    done = run(FOLDER / "batman.py", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert "28 of 28 properties hold" in done.stdout and "a proved property fails: 0" in done.stdout
    assert (tmp_path / "batman.svg").read_text().startswith("<svg")


@pytest.mark.slow
@needs("gcc")
@needs("make")
def test_the_lift_runs_as_a_daemon_and_its_recording_is_replayed(tmp_path: Path) -> None:
    folder, made, recording = FOLDER / "lift_daemon", tmp_path / "lift", tmp_path / "monday"
    assert main(["build", str(folder / "arrangement.yaml"), "--target", "c", "--for", "posix", "-o", str(made)]) == 0
    subprocess.run(["make", "-s", "-C", str(made), "lift"], check=True)
    done = run(folder / "shaft.py", str(made / "lift"), "--record", str(recording), "--cycles", "300", "--seed", "3")
    assert done.returncode == 0 and done.stdout.startswith("stopped: "), done.stdout + done.stderr
    assert main(["replay", str(recording)]) == 0
    assert main(["check-recording", str(recording), str(folder / "lift.ltl"), "--allow-undecided"]) == 0
