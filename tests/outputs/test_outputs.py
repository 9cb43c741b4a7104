"""What commands print and write stays as it is, unless somebody means to change it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.outputs.commands import COMMANDS, kept


@pytest.mark.slow
@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="kept as Python 3.11 words the help of commands")
def test_what_commands_print_and_write(tmp_path: Path) -> None:
    """In a process of its own: numbers that order formulas go on from what a process did before."""
    found = tmp_path / "outputs.txt"
    subprocess.run([sys.executable, "-m", "tests.outputs.commands", str(found)], check=True, timeout=200)
    expected, printed = kept(), kept(found)
    assert list(printed) == list(expected)
    for command, text in printed.items():
        assert text.split("\n") == expected[command].split("\n"), f"$ {command}"


def test_every_command_is_kept_once() -> None:
    assert len(set(COMMANDS)) == len(COMMANDS)
    assert list(kept()) == list(COMMANDS)
