from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import COUNTER, FAULTY, LIGHTS, PROPERTIES, llfsm, llfsm_process
from tests.processes import ended, wait_for_processor_time

ENDLESS = """
name: endless
cycle_ms: 1
whiteboard: {n: {type: int, init: 0}}
machines:
  m:
    inline: {machine: M, states: [{name: A, internal: n += 1;, transitions: [{when: n < 0, to: A}]}]}
schedule: [m]
"""


@pytest.mark.slow
def test_the_traffic_lights_hold():
    done = llfsm_process("verify", LIGHTS, PROPERTIES)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" and "violated" not in done.stdout and done.stdout.count("holds ") == 14


@pytest.mark.slow
def test_the_faulty_ones_do_not():
    done = llfsm("verify", FAULTY, PROPERTIES)
    assert done.returncode == 1 and "mutual_exclusion is violated" in done.stdout and "ns@GREEN" in done.stdout


def test_without_an_assumption_nobody_need_come():
    done = llfsm("verify", LIGHTS, "-p", "served: G F ew@GREEN", "-p", "G F ns@GREEN")
    assert done.returncode == 1 and "served is violated" in done.stdout and "repeat forever" in done.stdout
    assert "holds     L2" in done.stdout


def test_without_properties_faults_are_looked_for(tmp_path):
    done = llfsm("verify", "-", stdin=COUNTER)
    assert done.returncode == 1 and "FAULT" in done.stdout and "<stdin>:" in done.stdout and "n += 1" in done.stdout
    assert llfsm("verify", LIGHTS).returncode == 0


def test_holds_is_qualified_while_there_are_faults():
    done = llfsm("verify", "-", "-p", "small: G n <= 3", stdin=COUNTER)
    assert done.returncode == 1 and "holds on fault-free runs  small" in done.stdout


def test_properties_from_standard_input():
    assert llfsm("verify", LIGHTS, "-", stdin="x: G !(ns@GREEN && ew@GREEN)\n").returncode == 0


@pytest.mark.slow
def test_json_is_valid_against_the_published_schema():
    schema = json.loads(llfsm("schema", "result").stdout)
    assert schema == load("result")
    for model, code in ((LIGHTS, 0), (FAULTY, 1)):
        done = llfsm("verify", model, PROPERTIES, "--format", "json")
        value = json.loads(done.stdout)
        jsonschema.validate(value, schema)
        assert done.returncode == value["exit_code"] == code and value["complete"]
    done = llfsm("verify", "-", "--format", "json", stdin=COUNTER)
    value = json.loads(done.stdout)
    jsonschema.validate(value, schema)
    assert value["faults"]["list"][0]["trace"]["fault"]["code"] == "F001"


@pytest.mark.slow
def test_junit_counts_the_violations():
    suite = ET.fromstring(llfsm("verify", FAULTY, PROPERTIES, "--format", "junit").stdout).find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == ("14", "2")


@pytest.mark.slow
def test_quiet_prints_the_verdicts_alone():
    lines = llfsm("verify", FAULTY, PROPERTIES, "--quiet").stdout.splitlines()
    assert len(lines) == 14 and all(line.startswith(("holds", "violated")) for line in lines)


@pytest.mark.slow
def test_full_traces_fold_nothing():
    folded, full = (llfsm("verify", FAULTY, PROPERTIES, *more).stdout for more in ((), ("--all-steps",)))
    assert "without an event" in folded and "without an event" not in full
    assert len(full.splitlines()) > len(folded.splitlines()) + 50


@pytest.mark.slow
@pytest.mark.parametrize(
    "limit",
    [("--max-states", "100", "--engine", "explicit"), ("--timeout", "0.000001"), ("--memory", "1M")],
    ids=["states", "time", "memory"],
)
def test_what_is_cut_short_is_unknown(limit):
    done = llfsm("verify", "-", "-p", "grows: G n >= 0", *limit, stdin=ENDLESS)
    assert done.returncode == 4 and done.stdout.startswith("unknown") and "limit" in done.stdout
    assert "holds" not in done.stdout and "not complete" in done.stdout


@pytest.mark.slow
def test_interrupting_gives_the_partial_result():
    options = ["--engine", "explicit"]
    command = [sys.executable, "-m", "llfsm_verify", "verify", "-", "-p", "grows: G n >= 0", *options]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdin.write(ENDLESS)
    process.stdin.close()
    wait_for_processor_time(process, 2)
    process.send_signal(signal.SIGINT)
    process.stdin = None  # `communicate` would close it again
    output, errors = ended(process)
    assert process.returncode == 130 and output.startswith("unknown") and "interrupted" in output
    assert "Traceback" not in errors


@pytest.mark.slow
def test_a_closed_pipe_is_no_error():
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "llfsm_verify", "verify", FAULTY, PROPERTIES]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.slow
def test_colours_only_when_asked_for():
    assert "\x1b" not in llfsm_process("verify", FAULTY, PROPERTIES).stdout
    assert "\x1b[1;31mviolated" in llfsm_process("verify", FAULTY, PROPERTIES, "--color", "always").stdout
    assert "\x1b" not in llfsm_process("verify", FAULTY, PROPERTIES, "--color", "never", FORCE_COLOR="1").stdout


@pytest.mark.slow
def test_a_terminal_that_knows_only_ascii():
    done = llfsm_process("verify", FAULTY, PROPERTIES, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 1 and done.stderr == "" and "\\u2013131" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs the device that is always full")
def test_a_full_disk_is_said():
    command = [sys.executable, "-m", "llfsm_verify", "verify", LIGHTS, "-q"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 3 and done.stderr.startswith("<stdout>: error[E412]") and done.stderr.count("\n") == 1


@pytest.mark.slow
def test_closed_streams_leave_the_exit_code():
    command = f"{sys.executable} -m llfsm_verify verify {FAULTY} {PROPERTIES} >&- 2>&-"
    assert subprocess.run(command, shell=True, check=False).returncode == 1
