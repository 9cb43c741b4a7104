from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from llfsm_verify.cli.commands import llfsm_parser
from llfsm_verify.cli.commands.verify import run as verify
from llfsm_verify.cli.commands.verify import watching
from llfsm_verify.cli.inputs import files_read
from tests.cli.running import llfsm

ARRANGEMENT = (
    "machines: {m: {file: m.machine.yaml}, n: {inline: {machine: N, states: [{name: S}]}}}\nschedule: [m, n]\n"
)
MACHINE = "machine: M\nstates: [{name: A, transitions: [{when: 'true', to: B}]}, {name: B}]\n"


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "a.yaml").write_text(ARRANGEMENT)
    (tmp_path / "m.machine.yaml").write_text(MACHINE)
    (tmp_path / "p.ltl").write_text("p: G !m@B\nautomaton good: good.hoa\n")
    return tmp_path


class Watched:
    """A command that watches."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "llfsm_verify", "verify", "--watch", *arguments],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        )

    def until(self, text: str) -> str:
        """All that is printed up to the line with `text`."""
        seen = ""
        for line in self.process.stdout:
            seen += line
            if text in line:
                return seen
        raise AssertionError(f"{text!r} was not printed: {seen}")

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait()


@pytest.fixture
def watched(folder):
    (folder / "p.ltl").write_text("p: G !m@B\n")
    watched = Watched(folder, "a.yaml", "p.ltl")
    yield watched
    watched.process.kill()
    watched.process.wait()
    watched.process.stdout.close()


def replaced(path: Path, text: str) -> None:
    """As editors save: a new file takes the place of the old one, and is never seen half written."""
    path.with_suffix(".new").write_text(text)
    path.with_suffix(".new").replace(path)


@pytest.mark.slow
def test_saving_checks_again_until_interrupted(folder, watched):
    first = watched.until("watching 3 files; Ctrl-C ends")
    assert "violated  p" in first and "\x1b" not in first
    machine = folder / "m.machine.yaml"
    replaced(machine, MACHINE.replace("'true'", "'false'"))
    second = watched.until("watching")
    assert "changed: m.machine.yaml" in second and "p: violated → holds" in second
    replaced(machine, MACHINE)
    assert "violated  p" in watched.until("watching")
    assert list(watching.changes({"a": "holds", "b": "holds"}, {"a": "holds", "c": "unknown"})) == [
        "c: new, unknown",
        "b: not asked any more",
    ]
    # A mistake is shown, and mended in the file that has it.
    replaced(folder / "p.ltl", "p: G !m@C\n")
    assert "error[E112]" in watched.until("watching")
    replaced(folder / "p.ltl", "p: G !m@A\n")
    assert "violated  p" in watched.until("watching")
    machine.unlink()
    assert "error[E001]: machine file" in watched.until("watching")
    replaced(machine, MACHINE.replace("A", "Z"))
    watched.until("watching")
    assert watched.end() == 130


@pytest.mark.parametrize(("looks", "there"), [(3, True), (20, False)])
def test_a_file_that_is_missing_for_a_moment_is_waited_for(tmp_path, monkeypatch, looks, there):
    """Missing from the second look on, for so many looks."""
    machine, slept = tmp_path / "m.machine.yaml", 0

    def sleep(_):
        nonlocal slept
        slept += 1
        assert slept < 100
        if slept == 2:
            machine.unlink()
        elif slept == 2 + looks:
            machine.write_text(MACHINE + "\n")

    machine.write_text(MACHINE)
    known = watching.stamps([machine])
    monkeypatch.setattr(watching, "time", SimpleNamespace(sleep=sleep))
    assert watching.wait_for_change(known) == [machine]
    assert machine.exists() == there and (slept > 2 + looks) == there


def test_a_property_that_is_missing_for_a_moment_does_not_end_it(folder, monkeypatch, capsys):
    """`--only` names one that an edit has renamed: that is said as wrong usage, and the next change is waited for."""
    monkeypatch.chdir(folder)
    words = ["verify", "--watch", "a.yaml", "p.ltl", "--only", "renamed"]
    options = llfsm_parser(words).parse_args(words)
    waited = []

    def wait(known: object) -> list[Path]:
        waited.append(known)
        raise KeyboardInterrupt

    monkeypatch.setattr(watching, "wait_for_change", wait)
    with pytest.raises(KeyboardInterrupt):
        watching.watch(options, verify._verified)
    assert len(waited) == 1
    assert "error: --only: there is no property `renamed`" in capsys.readouterr().err


def test_the_files_of_a_check(folder):
    def names() -> list[str]:
        paths = files_read(folder / "a.yaml", [folder / "p.ltl"], ["automaton never bad: bad.hoa", "G G G"])
        return [path.name for path in paths]

    assert names() == ["a.yaml", "m.machine.yaml", "p.ltl", "good.hoa", "bad.hoa"]
    (folder / "p.ltl").write_text("p: G (\n")
    assert names() == ["a.yaml", "m.machine.yaml", "p.ltl", "bad.hoa"]
    (folder / "a.yaml").write_text("machines: [\n")
    assert names() == ["a.yaml", "p.ltl", "bad.hoa"]
    (folder / "a.yaml").unlink()
    assert names() == ["a.yaml", "p.ltl", "bad.hoa"]


@pytest.mark.parametrize(
    "arguments", [("-",), ("a.yaml", "--format", "json"), ("a.yaml", "--checkpoint", "c")], ids=" ".join
)
def test_what_cannot_be_watched_is_refused(folder, monkeypatch, arguments):
    monkeypatch.chdir(folder)
    done = llfsm("verify", "--watch", *arguments)
    assert done.returncode == 2 and done.stderr.startswith("error: --watch")
