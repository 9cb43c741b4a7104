"""`--engine pdr` and `induction`, `--save-invariants` and `--check-invariants`, as users call them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import COUNTER as ONE_OF_TWO
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.engines.inductive.test_examples import COUNTER, RUN_DOWN
from tests.processes import ended, wait_for_processor_time

MUTUAL = ("-p", "mutual: G !(ns@GREEN && ew@GREEN)")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pdr", "induction"])
def test_proofs_are_in_the_json(engine: str) -> None:
    done = llfsm("verify", LIGHTS, *MUTUAL, "--engine", engine, "--format", "json")
    result = json.loads(done.stdout)
    jsonschema.validate(result, load("result"))
    assert (done.returncode, result["engine"], result["complete"]) == (0, engine, True)
    (proof,) = result["properties"][0]["proofs"]
    assert proof["shows"] == "prefixes" and proof["checked_by"][0].startswith("Z3 ")
    assert result["faults"]["proofs"][0]["shows"] == "faults"


@pytest.mark.long
def test_a_violation_is_a_confirmed_run(tmp_path: Path) -> None:
    done = llfsm("verify", FAULTY, *MUTUAL, "--engine", "pdr", "--save-traces", str(tmp_path))
    assert done.returncode == 1 and "Violated after step" in done.stdout
    assert llfsm("replay", str(tmp_path / "mutual.trace.yaml")).returncode == 0


@pytest.mark.slow
def test_invariants_are_saved_and_checked(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    done = llfsm("verify", LIGHTS, *MUTUAL, "-q", "--engine", "pdr", "--save-invariants", str(path))
    assert (done.returncode, done.stderr) == (0, f"invariants saved: {path}\n")
    done = llfsm("verify", LIGHTS, *MUTUAL, "--check-invariants", str(path))
    assert done.stderr == ""
    assert done.returncode == 0 and done.stdout.startswith("accepted: mutual, checked by Z3")
    more = llfsm("verify", LIGHTS, *MUTUAL, "-p", "other: G ns@RED", "--check-invariants", str(path))
    assert more.returncode == 4 and "not proved: other, the file has no proof of it" in more.stdout
    other = llfsm("verify", FAULTY, *MUTUAL, "--check-invariants", str(path))
    assert other.returncode == 1 and "rejected: mutual, " in other.stdout
    assert (
        other.stderr
        == f"note: {path} was saved for the arrangement traffic_lights, and this is traffic_lights_faulty\n"
    )
    text = json.loads(path.read_text())
    text["proved"][0]["proofs"][0]["smt"] = "true"
    path.write_text(json.dumps(text))
    weak = llfsm("verify", LIGHTS, *MUTUAL, "--check-invariants", str(path))
    assert "rejected: mutual, implication fails: the invariant does not exclude the violation" in weak.stdout


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
        ("--check-invariants", "i", "--certificate", "c"),
        ("--check-invariants", "i", "--check-certificate", "c"),
        ("--check-invariants", "i", "--engine", "pdr"),
        ("--check-invariants", "i", "--save-traces", "t"),
        ("--check-invariants", "i", "--all", "2"),
        ("--check-invariants", "i", "--labels", "off"),
        ("--check-certificate", "i", "--save-traces", "t"),
        ("--save-invariants", "i", "--certificate", "./i"),
    ],
)
def test_options_that_do_not_fit(options: tuple[str, ...]) -> None:
    assert llfsm("verify", LIGHTS, *options).returncode == 2


def test_no_input_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(COUNTER)
    done = llfsm("verify", str(path), "--engine", "induction", "--save-invariants", str(path))
    assert done.returncode == 3 and "E454" in done.stderr and path.read_text() == COUNTER


@pytest.mark.slow
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
    assert not (tmp_path / "i.json").exists()


@pytest.mark.slow
def test_proofs_of_some_properties_are_saved(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    asked = ("-p", "good: G n <= 3", "-p", "bad: G n < 2", "--engine", "induction")
    done = llfsm("verify", "-", "-q", *asked, "--save-invariants", str(path), stdin=ONE_OF_TWO)
    assert (done.returncode, done.stderr) == (1, f"invariants saved: {path}\n")
    assert [(p["name"], len(p["proofs"])) for p in json.loads(path.read_text())["proved"]] == [("good", 1)]


def test_where_a_file_stops_being_json_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    path.write_text('{"format":\n  proved}')
    done = llfsm("verify", LIGHTS, *MUTUAL, "--check-invariants", str(path))
    assert done.returncode == 3 and "Expecting" not in done.stderr
    assert done.stderr.startswith(
        f"{path}:2:3: error[E453]: this is not a file of invariants: it is not JSON from here on"
    )


@pytest.mark.slow
def test_a_k_induction_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(COUNTER)
    told = llfsm("verify", str(path), "-p", "G step >= 1", "--engine", "induction").stdout
    assert (
        "k-induction, k = 1: this does not happen in the first cycle of any run; and where it has not happened in a "
        "cycle, through different configurations, it does not happen in the cycle after.\n"
    ) in told
    assert ", and proofs for runs of every length, complete, " in told


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


@pytest.mark.slow
def test_long_inductions_end_with_the_time(tmp_path: Path) -> None:
    path = tmp_path / "i.json"
    proof = {"shows": "faults", "bound": None, "k": 60_000, "smt": "true"}
    path.write_text(json.dumps({"format": "llfsm-invariants 1", "proved": [{"name": None, "proofs": [proof]}]}))
    done = llfsm("verify", LIGHTS, "--check-invariants", str(path), "--timeout", "0.5")
    assert done.returncode == 4 and "not checked to the end, because the time limit" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("engine", ["pdr", "induction"])
def test_an_interrupt_leaves_what_is_known(tmp_path: Path, engine: str) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(COUNTER)
    undecided = ("-p", RUN_DOWN, "-p", "G (c@DRAIN -> X F c@RUN)")
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(path), "-p", "step: G step >= 1", *undecided]
    pipe = subprocess.PIPE
    process = subprocess.Popen([*command, "--engine", engine, "-q"], stdout=pipe, stderr=pipe, text=True)
    wait_for_processor_time(process, 5)  # `step` is known in half a second, and all is tried in 20
    process.send_signal(signal.SIGINT)
    output, errors = ended(process)
    assert process.returncode == 130 and errors == ""
    assert "holds    step" in output and "because interrupted" in output
