"""What a command writes never takes the place of what it reads, and a place that cannot be written is told first."""

from __future__ import annotations

import os
from pathlib import Path
from unittest.mock import patch

import pytest

from tests.cli.running import LIGHTS, llfsm

EVER = "lights: G F timer.ran\n"
REACHED = "ns@GREEN"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A copy of the traffic lights, with a property file, that a test may spoil."""
    folder = tmp_path / "model"
    folder.mkdir()
    for file in Path(LIGHTS).parent.glob("*.yaml"):
        (folder / file.name).write_text(file.read_text())
    (folder / "p.ltl").write_text(EVER)
    return folder


WRITING = (
    ("query", "{arrangement}", REACHED, "--save", "{output}"),
    ("verify", "{arrangement}", "{properties}", "-q", "--certificate", "{output}"),
    ("verify", "{arrangement}", "{properties}", "-q", "--save-invariants", "{output}"),
    ("kripke", "{arrangement}", "{properties}", "--format", "smv", "-o", "{output}"),
    ("kripke", "{arrangement}", "{properties}", "--format", "aut", "-o", "{output}"),
    ("draw", "{arrangement}", "--format", "dot", "-o", "{output}"),
    ("monitor", "{properties}", "--arrangement", "{arrangement}", "-o", "{output}"),
    ("property", "draw", "{properties}", "--format", "dot", "-o", "{output}"),
)


CODES = {"--certificate": "E451", "--save-invariants": "E454"}


def filled(command: tuple[str, ...], model: Path, output: Path) -> list[str]:
    words = {"arrangement": model / "arrangement.yaml", "properties": model / "p.ltl", "output": output}
    return [word.format(**words) for word in command]


@pytest.mark.parametrize("command", WRITING, ids=lambda c: f"{c[0]} {c[-2]}")
def test_no_input_is_replaced(command: tuple[str, ...], model: Path) -> None:
    inputs = {"{arrangement}": ("arrangement.yaml", "light.machine.yaml"), "{properties}": ("p.ltl",)}
    for name in (name for word in command for name in inputs.get(word, ())):
        before = (model / name).read_text()
        link = model / "link"
        link.unlink(missing_ok=True)
        link.hardlink_to(model / name)
        for output in (model / name, link):
            done = llfsm(*filled(command, model, output))
            assert done.returncode == 3 and "would replace it" in done.stderr, (name, done.stderr)
            code = CODES.get(command[-2])
            assert code is None or f"error[{code}]" in done.stderr
            assert (model / name).read_text() == before


@pytest.mark.parametrize("command", WRITING, ids=lambda c: f"{c[0]} {c[-2]}")
def test_a_place_that_is_not_there_is_told_before_the_work(command: tuple[str, ...], model: Path) -> None:
    work = ("llfsm_verify.verification.verify.verify", "llfsm_verify.verification.query.verify")
    work = (*work, "llfsm_verify.kripke.structure.structure")
    with patch(work[0], None), patch(work[1], None), patch(work[2], None):
        done = llfsm(*filled(command, model, model / "none" / "x.out"))
    assert done.returncode == 3 and "cannot be written there: No such file or directory" in done.stderr
    with patch(work[0], None), patch(work[1], None), patch(work[2], None):
        done = llfsm(*filled(command, model, model))
    assert done.returncode == 3 and "Is a directory" in done.stderr
    assert sorted(p.name for p in model.parent.iterdir()) == ["model"]


@pytest.mark.slow
def test_a_run_replaces_runs_alone(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("precious\n")
    done = llfsm("query", LIGHTS, REACHED, "--save", str(path))
    assert done.returncode == 3 and "this file is not a trace" in done.stderr and path.read_text() == "precious\n"
    path.write_text("")
    assert llfsm("query", LIGHTS, REACHED, "--save", str(path)).returncode == 0
    saved = path.read_text()
    assert llfsm("query", LIGHTS, "ns@AMBER", "--save", str(path)).returncode == 0
    assert path.read_text() != saved
    assert llfsm("query", LIGHTS, REACHED, "--save", "-").returncode == 2


@pytest.mark.slow
def test_saved_traces_replace_traces_alone(model: Path) -> None:
    wrong = ("-p", "wrong: G !ns@GREEN", "-q", "--save-traces", str(model))
    path = model / "wrong.trace.yaml"
    for name in ("wrong.trace.yaml", "wrong.2.trace.yaml", "fault-1-F001.trace.yaml"):
        (model / name).write_text("precious\n")
        with patch("llfsm_verify.verification.verify.verify", None):
            done = llfsm("verify", LIGHTS, *wrong)
        assert done.returncode == 3 and "this file is not a trace" in done.stderr
        assert (model / name).read_text() == "precious\n"
        (model / name).unlink()
    (model / "arrangement.yaml").rename(path)
    before = path.read_text()
    done = llfsm("verify", str(path), *wrong)
    assert done.returncode == 3 and "has the name of a trace" in done.stderr and path.read_text() == before
    path.unlink()
    for _ in range(2):
        assert llfsm("verify", LIGHTS, *wrong).returncode == 1
    assert path.is_file()


def test_a_folder_for_traces_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with patch("llfsm_verify.verification.verify.verify", None):
        done = llfsm("verify", LIGHTS, "--save-traces", str(tmp_path / "file" / "traces"))
    assert done.returncode == 3 and "E405" in done.stderr


@pytest.mark.parametrize("target", ["none", "empty", "trace", "folder"])
def test_a_trace_is_not_written_through_a_link(tmp_path: Path, target: str) -> None:
    traces, other = tmp_path / "traces", tmp_path / "other"
    words = ("verify", LIGHTS, "-p", "wrong: G !ns@GREEN", "-q", "--save-traces", str(traces))
    assert llfsm(*words).returncode == 1
    path = traces / "wrong.trace.yaml"
    saved = path.read_text()
    path.unlink()
    path.symlink_to(other)
    if target == "folder":
        other.mkdir()
    elif target != "none":
        other.write_text(saved if target == "trace" else "")
    with patch("llfsm_verify.verification.verify.verify", None):
        done = llfsm(*words)
    assert done.returncode == 3 and f"{path}: error[E405]: this is a link" in done.stderr
    assert path.is_symlink() and [p.name for p in traces.iterdir()] == [path.name]
    assert not other.exists() if target == "none" else other.is_dir() or other.read_text() in ("", saved)


def test_a_link_that_has_come_meanwhile_is_not_written_through(tmp_path: Path) -> None:
    from llfsm_verify.verification.verify import verify

    def later(*words: object) -> object:
        (tmp_path / "wrong.trace.yaml").symlink_to(tmp_path / "other")
        return verify(*words)  # type: ignore[arg-type]

    with patch("llfsm_verify.verification.verify.verify", later):
        done = llfsm("verify", LIGHTS, "-p", "wrong: G !ns@GREEN", "-q", "--save-traces", str(tmp_path))
    assert done.returncode == 3 and "this is a link" in done.stderr and not (tmp_path / "other").exists()


def test_a_pipe_with_the_name_of_a_trace_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "wrong.trace.yaml")
    with patch("llfsm_verify.verification.verify.verify", None):
        done = llfsm("verify", LIGHTS, "-p", "wrong: G !ns@GREEN", "-q", "--save-traces", str(tmp_path))
    assert done.returncode == 3 and "E405" in done.stderr and "this is a pipe" in done.stderr


@pytest.mark.parametrize("option", ["--certificate", "--save-invariants"])
def test_a_proof_is_not_written_into_a_pipe_or_device(option: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (str(tmp_path / "pipe"), "/dev/null"):
        with patch("llfsm_verify.verification.verify.verify", None):
            done = llfsm("verify", LIGHTS, "-q", option, path)
        assert done.returncode == 3 and f"{path}: error[E45" in done.stderr and "must be a file" in done.stderr


def test_what_a_killed_run_has_left_is_in_nobodys_way(tmp_path: Path) -> None:
    """Also where the next process has the same number, as the first one in a container has."""
    left = tmp_path / f".x.dot.{os.getpid()}"
    left.write_text("half a draw")
    other = tmp_path / "other"
    (tmp_path / f".x.dot.{os.getpid()}-2").symlink_to(other)
    assert llfsm("draw", LIGHTS, "-o", str(tmp_path / "x.dot")).returncode == 0
    assert (tmp_path / "x.dot").read_text().startswith("digraph") and left.read_text() == "half a draw"
    assert not other.exists()


def test_permissions_stay(tmp_path: Path) -> None:
    path = tmp_path / "x.dot"
    for mode in (0o600, 0o664):
        path.write_text("")
        path.chmod(mode)
        assert llfsm("draw", LIGHTS, "-o", str(path)).returncode == 0
        assert path.stat().st_mode & 0o777 == mode
