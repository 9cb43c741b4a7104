"""`--engine bmc`: what it finds, what it says of the rest, and options that are another engine's."""

from __future__ import annotations

import json

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import LIGHTS, llfsm

R5 = ("models/microwave/faulty_R5.yaml", "-p", "stops: G (door_open -> X !motor)", "-p", "lit: G (motor -> lamp)")

WIDE = """
name: wide
whiteboard:
  distance: {type: 0..65535, init: 0, role: input}
  heat: {type: -20000..20000, init: 0, role: input}
  total: {type: int, init: 0}
machines:
  m:
    inline:
      machine: M
      initial: A
      states:
        - {name: A, internal: total = total + distance;, transitions: [{when: total > 131000 && heat < -19990, to: B}]}
        - {name: B}
schedule: [m]
"""


@pytest.mark.slow
def test_violations_are_found_and_the_rest_is_unknown():
    done = llfsm("verify", *R5, "--engine", "bmc", "--depth", "20", "--format", "json")
    result = json.loads(done.stdout)
    jsonschema.validate(result, load("result"))
    assert (done.returncode, result["engine"], result["depth"], result["complete"]) == (1, "bmc", 20, False)
    stops, lit = result["properties"]
    assert (stops["verdict"], len(stops["trace"]["steps"])) == ("violated", 20)
    assert (lit["verdict"], lit["reason"]) == (
        "unknown",
        "no run of up to 20 steps violates it (--depth N looks further)",
    )
    assert llfsm("verify", *R5[:1], *R5[3:], "--engine", "bmc", "--depth", "4").returncode == 4


def test_wide_inputs_and_numbers_without_end(tmp_path):
    """Nothing that could be enumerated."""
    done = llfsm("verify", "-", "-p", "never: G m@A", "--engine", "bmc", "--save-traces", str(tmp_path), stdin=WIDE)
    assert done.returncode == 1 and "violated  never" in done.stdout
    (tmp_path / "wide.yaml").write_text(WIDE)
    again = llfsm("replay", str(tmp_path / "never.trace.yaml"), "--arrangement", str(tmp_path / "wide.yaml"))
    assert again.returncode == 0 and "the failure still happens" in again.stdout


@pytest.mark.parametrize(
    "options",
    [
        ("--engine", "bmc", "--all", "2"),
        ("--engine", "bmc", "--checkpoint", "c"),
        ("--engine", "bmc", "--cone", "on"),
        ("--engine", "bmc", "--chains", "on"),
        ("--engine", "bmc", "--max-states", "7"),
        ("--engine", "bmc", "--vacuity"),
        ("--engine", "pdr", "--witness"),
        ("--engine", "induction", "--labels", "off"),
        ("--engine", "all", "--checkpoint", "c"),
        ("--engine", "explicit", "--depth", "7"),
    ],
)
def test_options_of_another_engine(options):
    done = llfsm("verify", LIGHTS, *options)
    assert done.returncode == 2 and "is for --engine" in done.stderr


@pytest.mark.long
def test_strict_looks_at_what_was_proved():
    command = ("verify", LIGHTS, "--engine", "pdr", "--strict")
    done = llfsm(*command, "-p", "a: G !(ns@GREEN && ew@GREEN)")
    assert (done.returncode, done.stderr) == (0, "")
    done = llfsm(*command, "-p", "a: G (ns@GREEN && ew@GREEN -> F car)")
    assert done.returncode == 1
    assert "fails --strict: `ns@GREEN && ew@GREEN` is never true in any run" in done.stdout


@pytest.mark.slow
def test_strict_wants_to_know_more_than_a_proof_tells():
    command = ("verify", LIGHTS, "-p", "forbid a: [ns@GREEN] [ew@GREEN]", "--engine", "pdr", "--strict")
    done = llfsm(*command)
    assert done.returncode == 4
    assert "unknown to --strict: not checked for vacuity: pdr explores no configurations" in done.stdout
    assert llfsm(*command, "--accept-vacuity", "a").returncode == 0
