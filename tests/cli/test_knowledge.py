"""Commands on arrangements that ask theories: recordings and guards have the theories with them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.resolve.arrangement import _kept_as
from tests.arrangement.test_knowledge import COOK, MACHINE, MICROWAVE
from tests.cli.running import llfsm

MONITOR = """\
machine: Own
parameters: {alarm: {whiteboard: bool}, motor: {whiteboard: bool}, door: {whiteboard: bool}}
knowledge:
  fine: {file: Fine.d, inputs: {on: motor, open: door}}
states:
  - {name: WATCH, internal: if (!fine) alarm = true;, stays: true}
"""
FINE = "input {on, open}.\n{} => fine.\nBAD: on, open -> ~fine.\noutput {b fine}.\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("inner").mkdir()
    board = MICROWAVE.replace("{file: m.", "{file: inner/m.").replace(
        "cycle_ms", "profile: {snapshot: cycle}\ncycle_ms"
    )
    texts = {
        "a.yaml": board,
        "Cook.d": COOK,
        "inner/m.machine.yaml": MACHINE,
        "inner/Cook.d": COOK.replace("=>", "->", 1),
    }
    for name, text in texts.items():
        Path(name).write_text(text)
    return tmp_path


@pytest.mark.slow
def test_a_recording_needs_no_files(folder: Path) -> None:
    run = "run a.yaml --simulate --seed 3 --for 4s --rate 0 --record r.rec -q"
    assert llfsm(*run.split()).returncode == 0
    for file in (*folder.glob("*.d"), *folder.glob("inner/*")):
        file.unlink()
    decided = llfsm("check-recording", "r.rec", "-p", "F !cook", "-p", 'G "cook == (time_left > 0 && !door)"')
    assert ["satisfied  L1" in decided.stdout, "undecided  L2" in decided.stdout] == [True, True]
    walked = llfsm("debug", "r.rec", "--command", "step 1", "--command", "why")
    assert "time_left > 0 = " in walked.stdout


@pytest.mark.slow
def test_a_guard_takes_theories_along(folder: Path) -> None:
    wanted = ("guard", "a.yaml", "-p", "G (motor -> cook)", "--fallback", "motor=false", "-o", "guarded")
    done = llfsm(*wanted)
    assert (done.returncode, "proved  L1" in done.stdout) == (0, True), done
    assert sorted(p.name for p in folder.glob("guarded/*.d")) == ["Cook.d", "Cook_2.d"]
    assert 'file: "Cook_2.d"' in Path("guarded/m.machine.yaml").read_text()
    assert Path("guarded/Cook_2.d").read_text() == Path("inner/Cook.d").read_text()


@pytest.mark.slow
def test_the_monitor_of_a_user_has_a_theory_of_its_own(folder: Path) -> None:
    (folder / "inner/own.machine.yaml").write_text(MONITOR)
    (folder / "inner/Fine.d").write_text(FINE)
    wanted = [
        "guard",
        "a.yaml",
        "--monitor",
        "inner/own.machine.yaml",
        "--fallback",
        "motor=false",
        "-o",
        "guarded",
        "-p",
    ]
    done = llfsm(*wanted, "G !(motor && door)")
    assert "error" not in done.stderr, done
    assert Path("guarded/Fine.d").read_text() == FINE
    assert "inputs: {on: motor_requested, open: door}" in Path("guarded/own.machine.yaml").read_text()


def test_a_routed_output_is_told_to_no_theory(folder: Path) -> None:
    (folder / "a.yaml").write_text((folder / "a.yaml").read_text().replace("door}}", "door || motor}}"))
    done = llfsm("guard", "a.yaml", "-p", "G !(motor && door)", "--fallback", "motor=false", "-o", "guarded")
    assert "error[E438]: `cook` depends on the output `motor`, which is routed" in done.stderr


def test_a_changed_theory_is_another_kept_arrangement(folder: Path) -> None:
    long = MACHINE.replace("motor = false;", "motor = false;\n" + "      // a long text\n" * 4000)
    (folder / "inner/m.machine.yaml").write_text(long)
    first = _kept_as(read_arrangement(Given("a.yaml")), integer_guards=False)
    (folder / "inner/Cook.d").write_text(COOK)
    second = _kept_as(read_arrangement(Given("a.yaml")), integer_guards=False)
    assert first is None or first != second
    assert (first is None) == (second is None)


@pytest.mark.slow
def test_a_certificate_is_about_theories_too(folder: Path) -> None:
    wanted = ("verify", "a.yaml", "-p", "G (cook -> !door)")
    assert llfsm(*wanted, "--certificate", "c.json").returncode == 0
    given = {name: kind for name, kind, _ in json.loads(Path("c.json").read_text())["inputs"]}
    assert {name for name, kind in given.items() if kind == "theory"} == {"Cook.d", "inner/Cook.d"}
    assert "compared" in llfsm(*wanted, "--check-certificate", "c.json").stdout
    (folder / "Cook.d").write_text(COOK + "% another text\n")
    assert llfsm(*wanted, "--check-certificate", "c.json").returncode != 0


def test_a_changed_theory_belongs_to_its_arrangement(folder: Path) -> None:
    assert "0 properties, no faults" in llfsm("check", "inner/Cook.d").stdout
    (folder / "inner/Cook.d").write_text(COOK + "C9 > C2.\n")
    assert "inner/Cook.d:6:1: error[E574]" in llfsm("check", "inner/Cook.d").stderr
    assert "this looks like a theory" in llfsm("verify", "Cook.d").stderr
