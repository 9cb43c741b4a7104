from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.running import FAULTY, llfsm
from tests.cli.test_verify import COUNTER

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


def test_everything_below_and_the_most_important_code(folder):
    done = llfsm("check")
    assert done.returncode == 1 and "model/other.yaml\n" in done.stdout and "FAULT" in done.stdout
    (folder / "model/properties.ltl").write_text("p: F m@C\n")
    done = llfsm("check")
    assert done.returncode == 3 and "error[E112]" in done.stderr and "FAULT" in done.stdout
    (folder / ".git").mkdir()
    (folder / ".git/a.yaml").write_text(COUNTER)
    assert ".git" not in llfsm("check").stdout


def test_the_file_of_properties_that_has_its_name(folder):
    (folder / "model/other.ltl").write_text("never: G false\n")
    assert "violated  never" in llfsm("check", "model/other.ltl").stdout


def test_a_path_that_is_not_there(folder):
    done = llfsm("check", "gone.yaml")
    assert done.returncode == 3 and "gone.yaml: error[E001]" in done.stderr


def test_the_faulty_lights_have_no_fault():
    assert llfsm("check", FAULTY).stdout == f"holds  {FAULTY}: 0 properties, no faults\n"
