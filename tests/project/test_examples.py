"""The examples run, and print what they should."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"


def run(path: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(path)]
    return subprocess.run(command, check=False, capture_output=True, text=True, cwd=FOLDER.parent)


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda p: p.stem)
def test_example_runs(path: Path) -> None:
    done = run(path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.slow
def test_the_traffic_lights_example_tells_what_it_found() -> None:
    done = run(FOLDER / "traffic_lights.py")
    assert "13 of 13 properties hold on 185 configurations" in done.stdout
    assert "the timer is in CAR_WAITING" in done.stdout
