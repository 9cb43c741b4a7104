"""`make check ROOM=…` looks at one room: its files and its tests, wherever they are."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.outside import needs
from tools.rooms import NoRoom, checked, places_of_tests, rooms, source_of


@pytest.mark.parametrize(
    ("room", "source", "tests"),
    [
        ("runtime/live", ["llfsm_verify/runtime/live"], ["tests/runtime/live"]),
        ("llfsm_verify/runtime/live/", ["llfsm_verify/runtime/live"], ["tests/runtime/live"]),
        ("runtime/launch", ["llfsm_verify/runtime/launch.py"], ["tests/runtime"]),
        ("files.py", ["llfsm_verify/files.py"], ["tests/test_files.py"]),
        ("certificate", ["llfsm_verify/certificate.py"], ["tests/analysis/certificates"]),
        ("project", [], ["tests/project"]),
        ("language", ["llfsm_verify/language"], ["tests/language", "tests/bad_input", "tests/fuzzing"]),
        (
            "arrangement/resolve",
            ["llfsm_verify/arrangement/resolve"],
            ["tests/arrangement", "tests/bad_input", "tests/fuzzing"],
        ),
    ],
)
def test_a_room_has_its_source_and_its_tests(room: str, source: list[str], tests: list[str]) -> None:
    name = checked(room)
    assert [path.as_posix() for path in source_of(name)] == source
    assert [path.as_posix() for path in places_of_tests(name)] == tests


def test_every_room_has_tests_that_are_there() -> None:
    for room in [*rooms(), *rooms("runtime"), *rooms("checking")]:
        assert places_of_tests(room) and all(path.exists() for path in places_of_tests(room)), room


@pytest.mark.parametrize(
    ("room", "says"),
    [
        ("runtim", "did you mean runtime?\nthe rooms: analysis api "),
        ("runtime/liv", "did you mean runtime/live?\nruntime: runtime/deciding "),
        ("nowhere/at/all", "there is no room nowhere/at/all\nthe rooms: analysis"),
        ("", "there is no room \n"),
        ("..", "there is no room ..\n"),
    ],
)
def test_an_unknown_room_says_what_there_is(room: str, says: str) -> None:
    with pytest.raises(NoRoom) as caught:
        checked(room)
    assert says in str(caught.value)


@pytest.fixture
def environment(tmp_path: Path) -> Path:
    """Tools that print how they are called, and a Python that does so where it does not look for rooms."""
    for name in ("ruff", "mypy", "lint-imports"):
        (tmp_path / name).write_text(f'#!/bin/sh\necho "{name} $*"\n')
    (tmp_path / "python").write_text(
        f'#!/bin/sh\ncase "$*" in *tools.rooms*) exec {sys.executable} "$@";; *) echo "python $*";; esac\n'
    )
    for path in tmp_path.iterdir():
        path.chmod(0o755)
    (tmp_path / ".check").touch()
    return tmp_path


def make(environment: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = ["make", "-s", "-o", f"{environment}/.check", f"VENV={environment}", f"BIN={environment}", "check"]
    return subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)


@pytest.mark.slow
@needs("make")
def test_make_checks_one_room(environment: Path) -> None:
    lines = make(environment, "ROOM=runtime/live").stdout.splitlines()
    files = "llfsm_verify/runtime/live tests/runtime/live"
    assert lines[:4] == [f"ruff format --check {files}", f"ruff check {files}", "mypy ", "lint-imports "]
    assert lines[-1].endswith("-m not slow and not long tests/runtime/live")


@needs("make")
def test_make_checks_everything_without_a_room(environment: Path) -> None:
    lines = make(environment).stdout.splitlines()
    assert lines[:2] == ["ruff format --check .", "ruff check ."] and lines[-1].endswith("-m not slow and not long")


@needs("make")
def test_make_runs_nothing_for_an_unknown_room(environment: Path) -> None:
    done = make(environment, "ROOM=runtim")
    assert done.returncode and not done.stdout and "did you mean runtime?" in done.stderr
