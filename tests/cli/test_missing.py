"""A package that is not installed is told with how to install it, whichever command or engine needs it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.running import LIGHTS, llfsm_process

MUTUAL = ("-p", "mutual: G !(ns@GREEN && ew@GREEN)")


@pytest.mark.parametrize(
    "command",
    [
        ("verify", LIGHTS, *MUTUAL, "--engine", "pdr"),
        pytest.param(("verify", LIGHTS, *MUTUAL, "--engine", "bmc"), marks=pytest.mark.slow),
        ("verify", LIGHTS, *MUTUAL, "--engine", "all"),
        pytest.param(("verify", LIGHTS, *MUTUAL, "--check-invariants", LIGHTS), marks=pytest.mark.slow),
        pytest.param(("query", LIGHTS, "ns@GREEN", "--engine", "induction"), marks=pytest.mark.slow),
        pytest.param(("lint", LIGHTS), marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_what_is_to_be_installed_is_said(tmp_path: Path, command: tuple[str, ...]) -> None:
    (tmp_path / "z3.py").write_text("raise ModuleNotFoundError(\"No module named 'z3'\", name='z3')\n")
    path = os.pathsep.join([str(tmp_path), str(Path.cwd())])
    done = llfsm_process(*command, PYTHONPATH=path)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.splitlines() == [
        "error[E464]: this needs the package z3-solver, which is not installed",
        "  hint: install it with `pip install z3-solver`",
    ]


def test_a_module_of_ours_that_is_not_there_is_our_mistake() -> None:
    from llfsm_verify.cli.missing import missing_package

    assert missing_package(ModuleNotFoundError("x", name="llfsm_verify.x")) is None
    assert missing_package(ModuleNotFoundError("x")) is None


@pytest.mark.slow
def test_an_engine_that_fails_beside_others_shows_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "z3.py").write_text("raise ValueError('broken')\n")
    path = os.pathsep.join([str(tmp_path), str(Path.cwd())])
    done = llfsm_process("verify", LIGHTS, *MUTUAL, "--engine", "all", PYTHONPATH=path)
    (told,) = done.stderr.splitlines()
    assert done.returncode == 70 and "failed: ValueError: broken" in told and "this is our bug" in told
