from __future__ import annotations

from argparse import Namespace
from pathlib import Path

import pytest

from llfsm_verify.cli.commands.check.run import run as check
from llfsm_verify.diagnostics import DiagnosticError
from tests.cli.running import COUNTER, FAULTY, llfsm

ARRANGEMENT = "machines: {m: {file: parts/m.machine.yaml}}\nschedule: [m]\n"
MACHINE = "machine: M\nstates: [{name: A, transitions: [{when: 'true', to: B}]}, {name: B}]\n"


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    (tmp_path / "model/parts").mkdir(parents=True)
    (tmp_path / "model/arrangement.yaml").write_text(ARRANGEMENT)
    (tmp_path / "model/parts/m.machine.yaml").write_text(MACHINE)
    (tmp_path / "model/properties.ltl").write_text("p: F m@B\n")
    (tmp_path / "model/other.yaml").write_text(COUNTER)
    (tmp_path / "compose.yaml").write_text("services:\n  web: {}\nprocesses:\n  a: {}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "path",
    ["model/arrangement.yaml", "model/parts/m.machine.yaml", "model/properties.ltl", "./model/../model/properties.ltl"],
)
def test_a_file_leads_to_its_arrangement(folder, path):
    done = llfsm("check", path, path, "compose.yaml")
    shown = "holds  model/arrangement.yaml model/properties.ltl: 1 property, no faults\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, shown, "")


def test_what_belongs_to_none_is_fine(folder):
    assert llfsm("check", "compose.yaml").stdout == ""


def test_a_sweep_that_is_named_is_told(folder):
    (folder / "SWEEP.yaml").write_text("arrangements: [model/arrangement.yaml]\n")
    done = llfsm("check", "SWEEP.yaml")
    said = "note: SWEEP.yaml is a sweep, so it was not checked; `llfsm sweep SWEEP.yaml` checks it\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, "", said)
    assert "SWEEP" not in llfsm("check", ".", "--jobs", "1").stderr


def test_properties_beside_no_arrangement_are_named(folder):
    """A user who names them expects that they are checked."""
    (folder / "lost.ltl").write_text("p: G false\n")
    done = llfsm("check", "model/arrangement.yaml", "lost.ltl", "-q")
    said = (
        "note: lost.ltl belongs to no arrangement, so it was not checked; `llfsm verify ARRANGEMENT lost.ltl` checks it"
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", said + "\n")


@pytest.mark.slow
def test_everything_below_and_the_most_important_code(folder):
    done = llfsm("check")
    assert done.returncode == 1 and "fails  model/other.yaml\n  violated  faults  " in done.stdout
    assert "  `llfsm verify model/other.yaml` shows the runs\n" in done.stdout and "step" not in done.stdout
    assert llfsm("check", "-q").stdout == "".join(done.stdout.splitlines(keepends=True)[1:])
    (folder / "model/properties.ltl").write_text("p: F m@C\n")
    done = llfsm("check")
    assert done.returncode == 3 and "error[E112]" in done.stderr and "violated  faults" in done.stdout
    (folder / ".git").mkdir()
    (folder / ".git/a.yaml").write_text(COUNTER)
    assert ".git" not in llfsm("check").stdout


def test_the_file_of_properties_that_has_its_name(folder):
    (folder / "model/other.ltl").write_text("never: G false\n")
    assert "violated  never" in llfsm("check", "model/other.ltl").stdout


@pytest.mark.parametrize(("path", "shown"), [("gone.yaml", "gone.yaml"), ("", "<empty path>")])
def test_a_path_that_is_not_there(folder, path, shown):
    done = llfsm("check", path)
    assert done.returncode == 3 and f"{shown}: error[E001]" in done.stderr


def test_an_arrangement_that_cannot_be_read_is_no_pass(folder):
    (folder / "model/other.yaml").write_bytes(b"# caf\xe9\n" + COUNTER.encode())
    (folder / "compose.yaml").write_bytes(b"# caf\xe9\nservices: {}\n")
    done = llfsm("check", "model/other.yaml", "compose.yaml")
    assert done.returncode == 3 and done.stderr.count("error[E005]") == 1


def test_a_folder_that_cannot_be_read_is_told(folder, monkeypatch):
    def scandir(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("os.scandir", scandir)
    with pytest.raises(DiagnosticError) as refused:
        check(Namespace(paths=["model"], color="never", width=None, quiet=False, jobs=None))
    assert [d.code for d in refused.value.diagnostics] == ["E002"]


def test_warnings_are_told(folder):
    (folder / "model/parts/m.machine.yaml").write_text(f"{MACHINE}parameters: {{other: machine}}\n")
    (folder / "model/arrangement.yaml").write_text(ARRANGEMENT.replace("yaml}", "yaml, parameters: {other: m}}"))
    done = llfsm("check", "model/arrangement.yaml")
    assert done.returncode == 0 and "warning[W001]" in done.stderr


def test_the_faulty_lights_have_no_fault():
    assert llfsm("check", FAULTY).stdout == f"holds  {FAULTY}: 0 properties, no faults\n"


@pytest.mark.parametrize(("error", "code", "words"), [(ValueError, 70, "our bug"), (MemoryError, 4, "out of memory")])
def test_one_failure_does_not_hide_the_others(folder, monkeypatch, error, code, words):
    from llfsm_verify.cli.commands.check import run as module

    real = module.verify

    def verify(arrangement, properties, options):
        if "other" in arrangement.path:
            raise error("broken")
        return real(arrangement, properties, options)

    (folder / "model/z.yaml").write_text(ARRANGEMENT)
    (folder / "model/a.yaml").write_text(ARRANGEMENT)
    monkeypatch.setattr(module, "verify", verify)
    done = llfsm("check", "model")
    assert done.returncode == code
    assert [line.split()[1].rstrip(":") for line in done.stdout.splitlines()] == [
        "model/a.yaml",
        "model/arrangement.yaml",
        "model/z.yaml",
    ]
    (told,) = done.stderr.splitlines()
    assert "model/other.yaml: " in told and words in told
