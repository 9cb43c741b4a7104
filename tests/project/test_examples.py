"""The examples run, and print what they should."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda p: p.stem)
def test_example_runs(path: Path) -> None:
    done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, timeout=60, cwd=FOLDER.parent)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


def test_the_traffic_lights_example_tells_what_it_found() -> None:
    done = subprocess.run(
        [sys.executable, str(FOLDER / "traffic_lights.py")], capture_output=True, text=True, timeout=60
    )
    assert "13 of 13 properties hold on 185 configurations" in done.stdout
    assert "the timer is in CAR_WAITING" in done.stdout
