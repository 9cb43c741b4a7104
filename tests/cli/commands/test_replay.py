from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli.running import COUNTER, FAULTY, LIGHTS, PROPERTIES, llfsm


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Path:
    """A copy of the faulty lights with their traces beside them."""
    folder = tmp_path_factory.mktemp("lights")
    shutil.copytree("models/traffic_lights", folder / "model")
    done = llfsm("verify", str(folder / "model/faulty.yaml"), PROPERTIES, "--save-traces", str(folder / "traces"))
    assert done.returncode == 1 and done.stderr.count("trace saved") == 2
    return folder


@pytest.mark.slow
def test_the_failure_still_happens(model):
    traces = sorted(map(str, (model / "traces").iterdir()))
    assert len(traces) == 2
    done = llfsm("replay", *traces)
    assert done.returncode == 0 and done.stdout.count("the failure still happens") == 2 and "note:" not in done.stdout
    assert len(llfsm("replay", "--quiet", *traces).stdout.splitlines()) == 2


@pytest.mark.slow
def test_after_the_mend_it_does_not(model):
    trace = model / "traces/mutual_exclusion.trace.yaml"
    done = llfsm("replay", str(trace), "--arrangement", LIGHTS)
    # Taken with the same inputs, the mended lights stay red where the saved run has them green.
    assert done.returncode == 1 and "does not happen any more" in done.stdout and "has changed" in done.stdout
    expecting = model / "traces/expecting.trace.yaml"
    expecting.write_text(trace.read_text().replace("expect: violated", "expect: holds"))
    assert llfsm("replay", str(expecting), "--arrangement", LIGHTS).returncode == 0
    assert llfsm("replay", str(expecting)).returncode == 1
    expecting.unlink()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("process: main, machine: ew", "process: rules, machine: ew"), "there is no process `rules` any more"),
        (("choices: {car: true}", "choices: {car: maybe}"), "neither true nor false"),
        (("text: G !(ns@GREEN", "text: G !(ns@BLUE"), "BLUE"),
        (("process: main, machine: timer", "ended: true, machine: timer"), "does not fit any more"),
        (("free: {}", "free: {mode: 3}"), "does not fit any more"),
    ],
    ids=["process", "value", "property", "end", "free"],
)
def test_what_no_longer_fits_is_3(model, change, says):
    text = (model / "traces/mutual_exclusion.trace.yaml").read_text()
    assert change[0] in text
    path = model / "traces/misfit.trace.yaml"
    path.write_text(text.replace(*change, 1))
    done = llfsm("replay", str(path))
    path.unlink()
    assert done.returncode == 3 and says in done.stdout + done.stderr and "Traceback" not in done.stderr


def test_a_fault_replays(tmp_path):
    (tmp_path / "counter.yaml").write_text(COUNTER)
    assert llfsm("verify", str(tmp_path / "counter.yaml"), "--save-traces", str(tmp_path / "t")).returncode == 1
    traces = sorted((tmp_path / "t").iterdir())
    assert [t.name for t in traces] == ["fault-1-F001.trace.yaml"] or len(traces) == 2
    done = llfsm("replay", *map(str, traces))
    assert done.returncode == 0 and "FAULT" in done.stdout
    (tmp_path / "counter.yaml").write_text(COUNTER.replace("0..3", "0..9"))
    done = llfsm("replay", *map(str, traces))
    assert done.returncode == 1 and "ends without a fault" in done.stdout


def test_a_trace_of_standard_input_needs_its_arrangement(tmp_path):
    (tmp_path / "counter.yaml").write_text(COUNTER)
    llfsm("verify", "-", "--save-traces", str(tmp_path), stdin=COUNTER)
    trace = next(tmp_path.glob("fault-1*"))
    done = llfsm("replay", str(trace))
    assert done.returncode == 3 and "E410" in done.stderr and "--arrangement" in done.stderr
    assert llfsm("replay", str(trace), "--arrangement", str(tmp_path / "counter.yaml")).returncode == 0


def test_the_worst_code_counts(model):
    good = str(model / "traces/mutual_exclusion.trace.yaml")
    assert llfsm("replay", good, FAULTY).returncode == 3


def test_a_trace_too_long_to_be_read_again_is_announced(tmp_path, monkeypatch):
    from llfsm_verify.yaml import nodes

    monkeypatch.setattr(nodes, "MAX_NODES", 500)
    done = llfsm("verify", FAULTY, "-p", "p: G !(ns@GREEN && ew@GREEN)", "--save-traces", str(tmp_path))
    assert done.returncode == 1 and "warning[W401]: it cannot be replayed" in done.stderr


OBSERVED_CYCLES = """
name: cycles
observe: cycle
whiteboard: {a: {type: bool, role: input}, b: {type: bool, role: input}}
machines:
  m: {inline: {machine: M, states: [{name: S, transitions: [{when: a, to: S}]}]}}
schedule: [m]
"""


def test_an_input_that_only_the_property_reads_is_replayed(tmp_path):
    (tmp_path / "cycles.yaml").write_text(OBSERVED_CYCLES)
    done = llfsm("verify", str(tmp_path / "cycles.yaml"), "-p", "x: G !b", "--save-traces", str(tmp_path / "traces"))
    assert done.returncode == 1
    done = llfsm("replay", "--quiet", str(tmp_path / "traces" / "x.trace.yaml"))
    assert (done.returncode, "still happens" in done.stdout) == (0, True)
