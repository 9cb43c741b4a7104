"""`--engine pdr` and `induction`, `--save-invariants` and `--check-invariants`, as users call them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.checking.inductive.test_examples import COUNTER, RUN_DOWN
from tests.cli.running import FAULTY, LIGHTS, llfsm

MUTUAL = ("-p", "mutual: G !(ns@GREEN && ew@GREEN)")


@pytest.mark.parametrize("engine", ["pdr", "induction"])
def test_proofs_are_in_the_json(engine: str) -> None:
    done = llfsm("verify", LIGHTS, *MUTUAL, "--engine", engine, "--format", "json")
    result = json.loads(done.stdout)
    jsonschema.validate(result, load("result"))
    assert (done.returncode, result["engine"], result["complete"]) == (0, engine, True)
    (proof,) = result["properties"][0]["proofs"]
    assert proof["shows"] == "prefixes" and proof["checked_by"][0].startswith("Z3 ")
    assert result["faults"]["proofs"][0]["shows"] == "faults"


def test_a_violation_is_a_confirmed_run(tmp_path: Path) -> None:
    done = llfsm("verify", FAULTY, *MUTUAL, "--engine", "pdr", "--save-traces", str(tmp_path))
    assert done.returncode == 1 and "Violated after step" in done.stdout
    assert llfsm("replay", str(tmp_path / "mutual.trace.yaml")).returncode == 0


def test_invariants_are_saved_and_checked(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    assert llfsm("verify", LIGHTS, *MUTUAL, "-q", "--engine", "pdr", "--save-invariants", str(path)).returncode == 0
    done = llfsm("verify", LIGHTS, *MUTUAL, "--check-invariants", str(path))
    assert done.returncode == 0 and done.stdout.startswith("accepted: mutual, checked by Z3")
    more = llfsm("verify", LIGHTS, *MUTUAL, "-p", "other: G ns@RED", "--check-invariants", str(path))
    assert more.returncode == 4 and "not proved: other, the file has no proof of it" in more.stdout
    other = llfsm("verify", FAULTY, *MUTUAL, "--check-invariants", str(path))
    assert other.returncode == 1 and "rejected: mutual, " in other.stdout


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("{", "E453"),
        ("[]", "E453"),
        ('{"format": "x"}', "its format"),
        ('{"format": "llfsm-invariants 1"}', "list"),
    ],
)
def test_files_that_are_none(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "i.json"
    path.write_text(text)
    done = llfsm("verify", LIGHTS, *MUTUAL, "--check-invariants", str(path))
    assert done.returncode == 3 and what in done.stderr
    assert llfsm("verify", LIGHTS, "--check-invariants", str(tmp_path / "none")).returncode == 3


@pytest.mark.parametrize(
    "options",
    [
        ("--engine", "explicit", "--save-invariants", "i.json"),
        ("--save-invariants", "-", "--engine", "pdr"),
        ("--save-invariants", "i", "--check-invariants", "j", "--engine", "pdr"),
        ("--check-invariants", "i", "--format", "json"),
    ],
)
def test_options_that_do_not_fit(options: tuple[str, ...]) -> None:
    assert llfsm("verify", LIGHTS, *options).returncode == 2


def test_no_input_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(COUNTER)
    done = llfsm("verify", str(path), "--engine", "induction", "--save-invariants", str(path))
    assert done.returncode == 3 and "E454" in done.stderr and path.read_text() == COUNTER


def test_no_machine_is_replaced(tmp_path: Path) -> None:
    for file in Path(LIGHTS).parent.glob("*.yaml"):
        (tmp_path / file.name).write_text(file.read_text())
    machine = tmp_path / "light.machine.yaml"
    before = machine.read_text()
    done = llfsm("verify", str(tmp_path / "arrangement.yaml"), "--engine", "pdr", "--save-invariants", str(machine))
    assert done.returncode == 3 and "E454" in done.stderr and machine.read_text() == before


def test_that_there_are_none_is_said(tmp_path: Path) -> None:
    done = llfsm("verify", LIGHTS, "--save-invariants", str(tmp_path / "i.json"))
    assert done.returncode == 0 and "no invariant was found" in done.stderr


@pytest.mark.parametrize(
    "term", ["true) (set-option :regular-output-channel {}) (assert true", "; (\n true)) (echo {}", "(and true", '"|"']
)
def test_a_term_is_no_command(tmp_path: Path, term: str) -> None:
    """What Z3 reads as commands can write files."""
    path, evil = tmp_path / "i.json", tmp_path / "evil"
    proof = {"shows": "faults", "bound": None, "k": 0, "smt": term.format(f'"{evil}"')}
    path.write_text(json.dumps({"format": "llfsm-invariants 1", "proved": [{"name": None, "proofs": [proof]}]}))
    done = llfsm("verify", LIGHTS, "--check-invariants", str(path))
    assert done.returncode == 1 and "rejected: faults, the invariant is not one term" in done.stdout
    assert not evil.exists()


def test_long_inductions_end_with_the_time(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    proof = {"shows": "faults", "bound": None, "k": 60_000, "smt": "true"}
    path.write_text(json.dumps({"format": "llfsm-invariants 1", "proved": [{"name": None, "proofs": [proof]}]}))
    done = llfsm("verify", LIGHTS, "--check-invariants", str(path), "--timeout", "0.5")
    assert done.returncode == 4 and "not checked to the end, because the time limit" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pdr", "induction"])
def test_an_interrupt_leaves_what_is_known(tmp_path: Path, engine: str) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(COUNTER)
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(path), "-p", "step: G step >= 1", "-p", RUN_DOWN]
    pipe = subprocess.PIPE
    process = subprocess.Popen([*command, "--engine", engine, "-q"], stdout=pipe, stderr=pipe, text=True)
    time.sleep(12)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=30)
    assert process.returncode == 130 and errors == ""
    assert "holds    step" in output and "because interrupted" in output
