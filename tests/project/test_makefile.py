from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.outside import needs

pytestmark = needs("make")


def fake(folder: Path, body: str) -> Path:
    """A Python that answers as `body` says, in shell."""
    path = folder / "python"
    path.write_text(f'#!/bin/sh\ncase "$*" in\n{body}\nesac\nexec {sys.executable} "$@"\n')
    path.chmod(0o755)
    return path


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    shutil.copy("Makefile", folder)
    (folder / "pyproject.toml").write_text("")
    return subprocess.run(["make", *arguments], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("target", ["verify", "test", "check"])
@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("*version_info*) exit 1;;", "needs Python 3.11 or newer"),
        ("*ensurepip*) exit 1;;", "has no venv module"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(tmp_path, target, body, says):
    done = make(tmp_path, target, f"PYTHON={fake(tmp_path, body)}")
    lines = [line for line in done.stderr.splitlines() if "***" not in line]
    assert done.returncode != 0 and len(lines) == 1 and says in lines[0]


def test_no_python_at_all(tmp_path):
    done = make(tmp_path, "verify", "PYTHON=no-such-python")
    assert done.returncode != 0 and "needs Python 3.11 or newer" in done.stderr


def test_ci_runs_what_the_readme_tells_newcomers():
    assert "make test " in Path("README.md").read_text()
    commands = [line for line in Path(".ci/run").read_text().splitlines() if line and not line.startswith("#")]
    assert commands[-2:] == ["make test", "make test-slow"] and Path(".ci/run").stat().st_mode & 0o111


def test_make_test_and_make_test_slow_leave_nothing_out():
    text = Path("Makefile").read_text()
    assert '-m "not long"\n' in text and "-m long\n" in text
