"""CONTRIBUTING.md names targets, files and names that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools.rooms import checked

TEXT = Path("CONTRIBUTING.md").read_text(encoding="utf-8")
QUOTED = re.findall(r"`([^`]+)`", TEXT)
PATHS = sorted({q for q in QUOTED if re.match(r"(llfsm_verify|tests)/", q)})
NAMES = re.findall(r"`(\w+)`(?:,)? (?:of|in)\s+`(llfsm_verify/[\w/]+\.py)`", TEXT)


@pytest.mark.parametrize("path", PATHS)
def test_a_file_or_folder_is_there(path):
    assert Path(path).exists()


@pytest.mark.parametrize(("name", "path"), NAMES)
def test_a_name_is_defined_in_the_file(name, path):
    assert re.search(rf"^(class |def )?{name}\b", Path(path).read_text(encoding="utf-8"), re.MULTILINE)


def test_there_are_names_and_files():
    assert len(NAMES) >= 8 and len(PATHS) >= 25


def test_targets_are_those_of_the_makefile():
    targets = set(re.findall(r"^([\w-]+):.*##", Path("Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {q.split()[1] for q in QUOTED if q.startswith("make ")}
    assert named and named <= targets


def test_rooms_are_there():
    named = re.findall(r"`make check ROOM=([^`]+)`", TEXT)
    assert named and [checked(room) for room in named] == named


def test_modules_that_are_called_can_be():
    called = {word for q in QUOTED for word in re.findall(r"python -m ([\w.]+)", q)}
    paths = [Path(*name.split(".")) for name in called]
    assert called and all(p.with_suffix(".py").exists() or (p / "__main__.py").exists() for p in paths)
