"""The options about checkpoints, and what a command says of them."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.ring import ring
from llfsm_verify.kept import cache_folder
from tests.cli.running import LIGHTS, llfsm, llfsm_process


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--checkpoint-every", "60"], "--checkpoint FILE"),
        (["--resume"], "--checkpoint FILE"),
        (["--checkpoint", ""], "the name of a file"),
    ],
)
def test_options_that_mean_nothing_are_refused(arguments: list[str], words: str) -> None:
    done = llfsm("verify", LIGHTS, *arguments)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert words in done.stderr
    assert done.stdout == ""


def test_an_input_is_never_replaced(tmp_path: Path) -> None:
    model, properties = tmp_path / "a.yaml", tmp_path / "none.ltl"
    model.write_text(ring(3, 2))
    properties.write_text("")
    (tmp_path / "link").hardlink_to(properties)
    before = model.read_bytes()
    for file in (model, properties, tmp_path / "link"):
        done = llfsm("verify", str(model), str(properties), "--checkpoint", str(file))
        assert done.returncode == 3
        assert "error[E415]" in done.stderr
    assert (model.read_bytes(), properties.read_bytes()) == (before, b"")


@pytest.mark.slow
@pytest.mark.parametrize("more", [[], ["--format", "json"]])
def test_a_full_disk_does_not_cost_the_result(tmp_path: Path, more: list[str]) -> None:
    model, path = tmp_path / "ring.yaml", tmp_path / "file"
    model.write_text(ring(4, 3))
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(model), "--keep-all-bits", "--checkpoint", str(path),
               "--checkpoint-every", "0.0001", "--max-states", "9000", *more]  # fmt: skip

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    done = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=limit)
    assert done.returncode == 4, done.stderr
    assert done.stderr.startswith(f"{path}: warning[W402]: the checkpoint cannot be written: File too large")
    assert done.stderr.count("W402") == 1
    if more:
        assert json.loads(done.stdout)["faults"]["verdict"] == "unknown"
    assert [p.name for p in tmp_path.iterdir()] == [model.name]


def test_chains_of_whole_cycles_are_said_not_to_exist(tmp_path: Path) -> None:
    model = tmp_path / "ring.yaml"
    model.write_text(ring(3, 2) + "\nobserve: cycle\n")
    done = llfsm("verify", str(model), "--chains", "on")
    assert done.returncode == 0
    assert "no chains of whole cycles" in done.stderr
    assert llfsm("verify", str(model), "--chains", "auto").stderr == ""


@pytest.fixture
def nearly_compiled(tmp_path: Path) -> Path:
    """A cache folder that lacks the smallest kernel: compiling all of them takes some seconds."""
    known = cache_folder()
    assert known is not None
    copy = tmp_path / "cache"
    shutil.copytree(known, copy)
    lacking = list(copy.glob("rebuild-*.o"))
    assert lacking
    for file in lacking:
        file.unlink()
    return copy


def by_numba(*arguments: str, cache: Path) -> str:
    """What a run without the package's texts of kernels says on standard error."""
    program = (
        "import sys; from llfsm_verify.cli import main; from llfsm_verify.kripke import compiled; "
        f"compiled.shipped = lambda *_: None; sys.exit(main({list(arguments)}))"
    )
    environment = {**os.environ, "LLFSM_CACHE": str(cache)}
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stderr


@pytest.mark.slow
def test_the_first_run_says_that_it_compiles(nearly_compiled: Path) -> None:
    said = by_numba("verify", LIGHTS, cache=nearly_compiled)
    assert said == "compiling the search kernels, once for this installation\n"
    assert llfsm_process("verify", LIGHTS, LLFSM_CACHE=str(nearly_compiled)).stderr == ""


@pytest.mark.slow
def test_quiet_compiles_silently(nearly_compiled: Path) -> None:
    assert by_numba("verify", LIGHTS, "-q", cache=nearly_compiled) == ""
    assert list(nearly_compiled.glob("rebuild-*.o"))
