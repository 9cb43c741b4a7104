"""Streams that cannot be written: what is said is lost, and the exit code is the same."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.running import FAULTY, LIGHTS, llfsm

FULL = Path("/dev/full")


@contextmanager
def stream(kind: str) -> Iterator[int]:
    """A pipe that nobody reads, or the device that is always full."""
    if kind == "full":
        if not FULL.exists():
            pytest.skip("there is no /dev/full here")
        writing = os.open(FULL, os.O_WRONLY)
    else:
        reading, writing = os.pipe()
        os.close(reading)
    try:
        yield writing
    finally:
        os.close(writing)


def run(module: str, *arguments: str, **streams: int) -> subprocess.CompletedProcess[str]:
    given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
    return subprocess.run([sys.executable, "-m", module, *arguments], text=True, check=False, **given)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["full", "unread"])
@pytest.mark.parametrize(
    ("arguments", "code"),
    [(("verify", "nowhere.yaml"), 3), (("property", "classify", "(p"), 3), (("verify", LIGHTS, "--depth", "x"), 2)],
    ids=["no file", "no formula", "no number"],
)
def test_standard_error_that_cannot_be_written_changes_no_exit_code(kind, arguments, code):
    with stream(kind) as writing:
        assert run("llfsm_verify", *arguments, stderr=writing).returncode == code


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["full", "unread"])
def test_a_violation_is_one_when_nobody_reads_what_was_saved(kind, tmp_path):
    asked = ("-p", "both: G !(ns@GREEN && ew@GREEN)", "-q", "--save-traces", str(tmp_path))
    with stream(kind) as writing:
        done = run("llfsm_verify", "verify", FAULTY, *asked, stderr=writing)
    assert done.returncode == 1 and "violated  both" in done.stdout
    assert (tmp_path / "both.trace.yaml").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("form", ["json", "sarif"])
def test_mistakes_that_cannot_be_written_are_said_once_and_are_3(form):
    with stream("full") as writing:
        done = run("llfsm_verify", "verify", "nowhere.yaml", "--format", form, stdout=writing)
    assert done.returncode == 3 and "Traceback" not in done.stderr
    assert done.stderr.count("E001") == done.stderr.count("E412") == 1


@pytest.mark.slow
def test_a_check_of_invariants_that_cannot_be_written(tmp_path):
    file = tmp_path / "i.json"
    proved = [{"name": "x", "text": "y", "proofs": []}]
    file.write_text(json.dumps({"format": "llfsm-invariants 1", "arrangement": "\x1b[2J", "proved": proved}))
    with stream("full") as writing:
        done = run("llfsm_verify", "verify", LIGHTS, "--check-invariants", str(file), stdout=writing)
    assert done.returncode == 3 and "E412" in done.stderr and "\x1b" not in done.stderr


def test_a_version_that_cannot_be_written():
    with stream("full") as writing:
        done = run("llfsm_verify", "--version", stdout=writing)
    assert done.returncode == 2 and done.stderr == "error: the version cannot be written: No space left on device\n"


def test_an_answer_about_a_certificate_without_standard_output(tmp_path):
    (tmp_path / "c.json").write_text("{}\n")
    done = subprocess.run(
        ["sh", "-c", 'exec "$@" >&-', "sh", sys.executable, "-m", "llfsm_verify.certificate", str(tmp_path / "c.json")],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 1 and done.stderr == ""


@pytest.mark.parametrize("kind", ["full", "unread"])
def test_an_answer_about_a_certificate_that_cannot_be_written(kind, tmp_path):
    (tmp_path / "c.json").write_text("{}\n")
    with stream(kind) as writing:
        done = run("llfsm_verify.certificate", str(tmp_path / "c.json"), stdout=writing)
    assert done.returncode == 3
    assert done.stderr.startswith("the answer cannot be written: ") and done.stderr.count("\n") == 1


def test_what_is_quoted_steers_no_terminal():
    for arguments, code in (
        (("verify", LIGHTS, "-p", 'a: G "\x1b[2Jn" == 1'), 3),
        (("simulate", LIGHTS, "--set", "\x1b[2J"), 2),
        (("verify", LIGHTS, "--\x1b[2J"), 2),
    ):
        done = llfsm(*arguments)
        assert done.returncode == code and "\x1b" not in done.stderr, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "code"), [("full", 3), ("unread", 0)])
def test_the_report_of_a_run_that_cannot_be_written(kind, code):
    with stream(kind) as writing:
        done = run("llfsm_verify", "run", LIGHTS, "--rate", "0", "--for", "3s", stdout=writing)
    assert done.returncode == code and ("E412" in done.stderr) == (kind == "full") and "bug" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "code"), [("full", 3), ("unread", 1)])
def test_a_decision_on_a_recording_that_cannot_be_written(kind, code, tmp_path):
    recording = str(tmp_path / "a.rec")
    assert run("llfsm_verify", "run", LIGHTS, "--simulate", "--for", "5s", "--record", recording).returncode == 0
    with stream(kind) as writing:
        done = run("llfsm_verify", "check-recording", recording, "-p", "G ns@RED", stdout=writing)
    assert done.returncode == code and ("E412" in done.stderr) == (kind == "full"), done.stderr
