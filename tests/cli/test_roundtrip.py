"""Every kind of choice that a trace can hold survives the way through a file and is replayed."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.report.schema import load
from llfsm_verify.verification.tracefile_fields import schema
from tests.cli.running import llfsm

WARNING = re.compile(r"warning\[(\w+)\]")

MODELS: dict[str, tuple[str, str]] = {
    "an arrangement that ends": (
        """
cycle_ms: 1
machines: {m: {inline: {machine: M, states: [{name: A, transitions: [{when: true, to: B}]}, {name: B}]}}}
schedule: [m]
""",
        "G F m@A",
    ),
    "several processes": (
        """
cycle_ms: 1
whiteboard: {n: {type: 0..3, init: 0}}
machines:
  a: {inline: {machine: A, states: [{name: S, internal: n = 1;, transitions: [{when: n == 3, to: S}]}]}}
  b: {inline: {machine: B, states: [{name: S, internal: n = 2;, transitions: [{when: n == 3, to: S}]}]}}
processes: {left: [a], right: [b]}
""",
        "G !(n == 2 && X n == 1 && X X n == 2)",
    ),
    "untimed clocks": (
        """
timing: untimed
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, transitions: [{when: after(1), to: B}, {when: after(5), to: C}]}
        - {name: B, transitions: [{when: after(2), to: A}]}
        - {name: C, transitions: [{when: true, to: A}]}
schedule: [m]
""",
        "G !m@B",
    ),
    "reads one by one": (
        """
profile: clfsm
cycle_ms: 1
whiteboard: {i: {type: 0..2, init: 0, role: input}, odd: {type: bool, init: false}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: odd = i != i;, transitions: [{when: i > 5, to: A}]}
schedule: [m]
""",
        "G !odd",
    ),
    "inputs that never change": (
        """
cycle_ms: 1
types: {Mode: [OFF, SLOW, FAST]}
whiteboard:
  mode: {type: Mode, role: input, changes: never}
  n: {type: 0..2, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: if (mode == FAST && n < 2) n += 1;, transitions: [{when: n > 2, to: A}]}
schedule: [m]
""",
        "G n < 2",
    ),
    "inputs that change once a cycle": (
        """
cycle_ms: 1
whiteboard: {go: {type: bool, init: false, role: input, changes: cycle}}
machines:
  a:
    inline:
      machine: A
      states:
        - {name: S, transitions: [{when: go, to: T}]}
        - {name: T, transitions: [{when: not go, to: S}]}
  b:
    inline:
      machine: A
      states:
        - {name: S, transitions: [{when: go, to: T}]}
        - {name: T, transitions: [{when: not go, to: S}]}
schedule: [a, b]
""",
        "G !(a@T && b@T)",
    ),
    "arrays, records and enumerations as inputs": (
        """
cycle_ms: 1
types: {Colour: [RED, GREEN], Ball: {record: {x: -2..2, seen: bool}}}
whiteboard:
  balls: {type: {array: Ball, size: 2}, role: input}
  colour: {type: Colour, init: RED, role: input}
  hit: {type: bool, init: false}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          internal: hit = balls[1].seen && balls[1].x == -2 && colour == GREEN;
          transitions: [{when: '9 < balls[0].x', to: A}]
schedule: [m]
""",
        "G !hit",
    ),
    "whole cycles": (
        """
cycle_ms: 1
observe: cycle
whiteboard: {go: {type: bool, init: false, role: input}, n: {type: 0..3, init: 0}}
machines:
  a:
    inline:
      machine: A
      states: [{name: S, internal: if (go && n < 3) n += 1;, transitions: [{when: n > 8, to: S}]}]
  b: {inline: {machine: B, states: [{name: S, internal: if (n == 3) n = 0;, transitions: [{when: n > 8, to: S}]}]}}
schedule: [a, b]
""",
        "F n == 3",
    ),
    "suspended machines": (
        """
cycle_ms: 1
whiteboard: {go: {type: bool, init: false, role: input}}
machines:
  a:
    inline:
      machine: A
      states:
        - {name: S, transitions: [{when: go && is_running(b), to: T}]}
        - {name: T, on_entry: suspend(b);, transitions: [{when: go, to: S}]}
  b: {inline: {machine: B, states: [{name: S, transitions: [{when: is_suspended(a), to: S}]}]}}
schedule: [a, b]
""",
        "G !b.suspended",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_a_violation_is_saved_and_happens_again(name, tmp_path: Path):
    text, formula = MODELS[name]
    (tmp_path / "a.yaml").write_text(f"name: a\n{text}")
    done = llfsm("verify", str(tmp_path / "a.yaml"), "-p", f"p: {formula}", "--save-traces", str(tmp_path / "t"))
    assert done.returncode == 1, done.stdout + done.stderr
    trace = tmp_path / "t/p.trace.yaml"
    jsonschema.Draft202012Validator(schema("trace")).validate(yaml.safe_load(trace.read_text()))
    again = llfsm("replay", str(trace))
    assert again.returncode == 0, again.stdout + again.stderr
    shown = llfsm("verify", str(tmp_path / "a.yaml"), "-p", f"p: {formula}", "--format", "json")
    jsonschema.Draft202012Validator(load("result")).validate(json.loads(shown.stdout))
    ran = llfsm("simulate", str(tmp_path / "a.yaml"), "--steps", "30", "--seed", "3")
    # Guards that never hold keep these states from accepting; each is warned of.
    assert ran.returncode == 0 and "error" not in ran.stderr and set(WARNING.findall(ran.stderr)) <= {"W002"}
    drawn = llfsm("draw", str(tmp_path / "a.yaml"))
    assert drawn.returncode == 0
