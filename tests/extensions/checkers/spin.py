"""Running SPIN on a model."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.outside import needs

needs_spin = needs("spin", "gcc")


def _run(folder: Path, *words: str) -> str:
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def _compile(folder: Path, text: str, *flags: str) -> None:
    folder.joinpath("model.pml").write_text(text)
    said = _run(folder, "spin", "-o2", "-a", "model.pml")
    assert folder.joinpath("pan.c").exists() and "Error" not in said, said
    said = _run(folder, "gcc", "-w", "-O0", "-DNOREDUCE", *flags, "-o", "pan", "pan.c")
    assert folder.joinpath("pan").exists(), said


def count(folder: Path, text: str) -> tuple[int, bool]:
    """The number of states, and whether some run violates an assertion."""
    _compile(folder, text, "-DSAFETY")
    whole = _run(folder, "./pan", "-m200000", "-w18", "-A", "-E")
    found = re.search(r"(\d+) states, stored", whole)
    assert found and "errors: 0" in whole and "max search depth too small" not in whole, whole
    first = _run(folder, "./pan", "-m200000", "-w18")
    assert "pan:1: invalid end state" not in first, first
    return int(found[1]), "errors: 0" not in first


def answers(folder: Path, text: str, names: Sequence[str]) -> dict[str, bool]:
    """Whether each claim holds."""
    _compile(folder, text)
    found = {}
    for name in names:
        said = _run(folder, "./pan", "-m1000000", "-w18", "-a", "-N", name)
        assert "states, stored" in said and "max search depth too small" not in said, said
        found[name] = "errors: 0" in said
    return found
