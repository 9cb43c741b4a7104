"""L023 and L024: machines that finish while others go on, and reads that come a cycle late, as runs show them."""

from __future__ import annotations

from itertools import permutations

import pytest

import llfsm_verify as lv
from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.arrangement import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties

LAMP = """
cycle_ms: 1000
whiteboard: {on: {type: bool, role: output}, hot: {type: bool, role: output}, go: {type: bool, role: input}}
machines:
  lamp:
    inline:
      machine: Lamp
      states:
        - {name: OFF, on_entry: on = false;, transitions: [{when: after(2), to: ON}]}
        - {name: ON, on_entry: on = true;}
  fan:
    inline:
      machine: Fan
      states:
        - {name: A, on_entry: hot = true;, transitions: [{when: go, to: B}]}
        - {name: B, on_entry: hot = false;, transitions: [{when: after(1), to: A}]}
schedule: [lamp, fan]
"""
ENDS = "- {name: ON, on_entry: on = true;}"


def said(text, code, properties=""):
    arrangement = load_arrangement_text(text)
    atoms = bind(arrangement, parse_properties([Source("p", properties)])).atoms
    return [(f.message, f.span.text) for f in lint(arrangement, local=True, atoms=atoms).shown if f.code == code]


@pytest.mark.slow
def test_a_forgotten_way_out_is_said_at_its_state():
    message = "`lamp` finishes in `ON`, and other machines go on: the state has no transitions"
    assert said(LAMP, "L023") == [(message, "ON")]
    note = next(f for f in lint(load_arrangement_text(LAMP)).shown if f.code == "L023")
    assert note.level == "note" and note.hint is not None and "`stays: true`" in note.hint


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (ENDS, ENDS.replace("}", ", stays: true}")),
        (ENDS, ENDS.replace("}", ", lint: {L023: a lamp is lit once}}")),
        ("transitions: [{when: after(1), to: A}]}", "}"),  # the other one finishes as well: the arrangement ends
        ("on_entry: hot = false;", "on_entry: restart(lamp);"),
        ("on: {type: bool, role: output}", "on: {type: bool}"),  # nobody needs it
        ("schedule:", "operators: {restart: [lamp]}\nschedule:"),
        ("transitions: [{when: after(2), to: ON}]}", "}"),  # it acts once, whatever happens
    ],
)
def test_a_machine_that_may_finish_is_not_noted(old, new):
    assert old in LAMP
    assert said(LAMP.replace(old, new), "L023") == []


def test_properties_that_ask_for_the_end_mean_it():
    assert said(LAMP, "L023", "x: F lamp.finished") == []
    assert len(said(LAMP, "L023", "x: F lamp@ON")) == 1


@pytest.mark.slow
def test_what_is_never_reached_is_left_to_l002():
    text = LAMP.replace("when: after(2)", "when: after(2) && false")
    codes = [f.code for f in lint(load_arrangement_text(text)).findings]
    assert "L002" in codes and "L023" not in codes


def chain(schedule, back=False):
    """Machines each of which copies what the one before has written; `first` counts. `back`: it reads the last."""
    first = "x0 = (x0 + 1) % 100;" if not back else "x0 = (x0 + x2 / 100 + 1) % 100;"
    machines = {"m0": first, "m1": "x1 = x0;", "m2": "x2 = x1;"}
    return {
        "whiteboard": {"x0": {"type": "0..99"}, "x1": {"type": "0..99"}, "x2": {"type": "0..99", "role": "output"}},
        "machines": {
            name: {"inline": {"machine": name.upper(), "states": [{"name": "A", "internal": text, "stays": True}]}}
            for name, text in machines.items()
        },
        "schedule": list(schedule),
    }


@pytest.mark.slow
@pytest.mark.parametrize("schedule", list(permutations(["m0", "m1", "m2"])))
def test_notes_are_as_many_as_the_cycles_that_a_run_is_late(schedule):
    arrangement = build_arrangement(chain(schedule))
    notes = [f for f in lint(arrangement, local=True).shown if f.code == "L024"]
    run = lv.Model(arrangement).start(seed=1)
    run.run(60)
    assert run.values["x0"] - run.values["x2"] == len(notes)
    for note in notes:
        reader, writer = note.machines
        assert schedule.index(reader) < schedule.index(writer)
        assert note.message == f"`{reader}` has its turn before `{writer}`, so it reads `x{writer[1]}` a cycle late"


@pytest.mark.parametrize("schedule", list(permutations(["m0", "m1", "m2"])))
def test_in_a_circle_somebody_is_late(schedule):
    assert not [f for f in lint(build_arrangement(chain(schedule, back=True)), local=True).shown if f.code == "L024"]


COPY = """
whiteboard: {go: {type: bool, role: input}, wish: {type: bool}, lamp: {type: bool, role: output}}
machines:
  a: {inline: {machine: Lamp, states: [{name: A, internal: lamp = wish;, stays: true}]}}
  b: {inline: {machine: Wish, states: [{name: A, internal: wish = go;, stays: true}]}}
schedule: [a, b]
"""


@pytest.mark.parametrize(
    ("old", "new", "notes"),
    [
        ("", "", 1),
        ("lamp = wish;", "if (b@A) lamp = true;", 1),  # the state of a machine is such a variable
        ("schedule: [a, b]", "schedule: [b, a]", 0),
        ("schedule: [a, b]", "processes: {p: [a], q: [b]}", 0),
        ("schedule: [a, b]", "operators: {write: [wish]}\nschedule: [a, b]", 0),  # others also write it
        ("lamp = wish;", "lamp = wish; wish = false;", 0),  # it writes itself what it reads
        ("lamp = wish;", "lamp = go;", 0),
        ("internal: lamp = wish;", "internal: lamp = wish;, lint: {L024: as in the paper}", 0),
    ],
)
def test_what_is_late_and_what_is_not(old, new, notes):
    assert old in COPY
    assert len(said(COPY.replace(old, new) if old else COPY, "L024")) == notes


@pytest.mark.slow
def test_the_wrong_order_of_the_komodo_region_is_found():
    """A model whose mistake is the order of the schedule alone."""
    found = lint(load_arrangement("models/komodo_region/faulty_order.yaml"), local=True).shown
    assert ("L024", ("monitor", "stroll")) in [(f.code, f.machines) for f in found]
    right = lint(load_arrangement("models/komodo_region/arrangement.yaml"), local=True).shown
    assert "L024" not in [f.code for f in right]
