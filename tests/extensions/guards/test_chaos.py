"""What chaos can do: for each power an arrangement in which a machine that has it breaks what is guarded."""

import pytest

from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.extensions.guards.guardable import unfit, unfit_assumptions
from tests.extensions.guards.helpers import draft_of, guarded, lines_of, proved

AT_ONCE = (
    "own.machine.yaml",
    "machine: O\nparameters: {alarm: {whiteboard: bool}}\nstates: [{name: S, internal: alarm = true;, stays: true}]\n",
)
"""A monitor that reads nothing: what follows is the fallback's."""
TEXT = """\
name: powers
cycle_ms: 100
whiteboard:
  car: {type: 0..3, role: input}
  seen: {type: 0..3}
  slot: {type: bool}
  other: {type: 0..9, init: 1}
  speed: {type: 0..9, role: output}
machines:
  helper:
    inline:
      machine: H
      suspend: ASIDE
      states:
        - {name: FIRST, transitions: [{when: slot, to: NEXT}]}
        - {name: NEXT, internal: HELPS, stays: true}
        - {name: ASIDE, on_entry: other = SUSPENDED;, stays: true}
  driver:
    inline:
      machine: D
      states:
        - {name: S, internal: speed = 3;, transitions: [{when: speed > 3, to: T}]}
        - {name: T}
  spare: {inline: {machine: P, states: [{name: S, internal: other = LOADED;, stays: true}]}}
schedule: [helper, driver]
pool: [spare]
access:
  levels: [low, high]
  machines: {helper: high, spare: high}
  write: {seen: high, other: high, slot: low}
  command: {helper: HELPER, spare: SPARE}
"""
BLANKS = {"HELPS": "other = 1;", "SUSPENDED": "1", "LOADED": "1", "HELPER": "high", "SPARE": "high"}
GONE = "if (!is_running(driver) && !is_suspended(driver)) other = 9;"
POWERS = {
    "none": ({}, True),
    "write": ({"HELPS": "other = 9;"}, False),
    "write what it must not": ({"HELPS": "other = 9;", "slot: low": "slot: high"}, True),
    "suspend": ({"SUSPENDED": "9", "HELPER": "low"}, False),
    "suspend what it must not": ({"SUSPENDED": "9"}, True),
    "load": ({"LOADED": "9", "SPARE": "low"}, False),
    "load what it must not": ({"LOADED": "9"}, True),
    "show a state": ({"HELPS": "if (driver@T) other = 9;"}, False),
    "suspend itself": ({"HELPS": "if (is_suspended(driver)) other = 9;"}, False),
    "finish, unload itself or fault": ({"HELPS": GONE}, False),
    "read an input after others": (
        {"HELPS": "seen = car;", "{name: FIRST": "{name: FIRST, internal: seen = car;, on_exit: seen = car;"},
        False,
    ),
}
PROPERTY = {"read an input after others": ("speed < 6 || car < 2", "seen < 2 ? 9 : 1")}


def powers(changes):
    text = TEXT
    for old, new in (changes | {k: v for k, v in BLANKS.items() if k not in changes}).items():
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.slow
@pytest.mark.parametrize("power", POWERS)
def test_chaos_has_the_power(power):
    changes, kept = POWERS[power]
    formula, fallback = PROPERTY.get(power, ("speed < 6", "other"))
    made, lines = guarded(powers(changes), [f"p: G ({formula})"], {"speed": fallback}, ("driver",), AT_ONCE)
    proof = proved(made, lines)
    assert proof.exit_code == (0 if kept else 1)
    assert proof.result.properties[0].verdict is (Verdict.HOLDS if kept else Verdict.VIOLATED)


@pytest.mark.slow
@pytest.mark.parametrize("snapshot", ["none", "ringlet", "after_entry", "cycle"])
def test_an_input_is_read_after_others_unless_it_is_read_once_a_cycle(snapshot):
    changes, _ = POWERS["read an input after others"]
    formula, fallback = PROPERTY["read an input after others"]
    text = powers(changes) + f"profile: {{base: llfsm, snapshot: {snapshot}}}\n"
    made, lines = guarded(text, [f"p: G ({formula})"], {"speed": fallback}, ("driver",), AT_ONCE)
    assert proved(made, lines).exit_code == (0 if snapshot == "cycle" else 1)


@pytest.mark.slow
def test_what_holds_without_commands_is_asked_again_with_them():
    """One property is violated without a command, the other one only with `suspend(helper)`."""
    text = powers({"SUSPENDED": "9", "HELPER": "low"}).replace("slot: {type: bool}", "slot: {type: bool, role: output}")
    text = text.replace("internal: speed = 3;", "internal: 'speed = 3; slot = true;'")
    asked = ["dark: G !slot", "slow: G speed < 6", "any: G speed < 10"]
    made, lines = guarded(text, asked, {"speed": "other", "slot": "true"})
    proof = proved(made, lines)
    verdicts = {found.name: found.verdict for found in proof.result.properties}
    assert verdicts == {"dark": Verdict.VIOLATED, "slow": Verdict.VIOLATED, "any": Verdict.HOLDS}


@pytest.mark.slow
@pytest.mark.parametrize(("first", "code"), [("1", 0), ("0", 1)])
def test_a_fault_that_only_chaos_in_other_places_leads_to_is_none(first, code):
    """Chaos in the place of the helper would have the fallback divide by zero."""
    text = powers({}).replace("other: {type: 0..9, init: 1}", f"other: {{type: 0..9, init: {first}}}")
    made, lines = guarded(text, ["slow: G speed < 6"], {"speed": "5 / other"})
    proof = proved(made, lines)
    assert (proof.exit_code, proof.machines) == (code, ("driver",))


NESTED = """\
name: nested
cycle_ms: 100
whiteboard: {speed: {type: 0..9, role: output}}
machines:
  boss:
    inline:
      machine: B
      states:
        - {name: A, runs: [inner], transitions: [{when: after_ms(300), to: C}]}
        - {name: C, transitions: [{when: after_ms(300), to: A}]}
  inner: {inline: {machine: I, states: [{name: S, stays: true}]}}
  driver: {inline: {machine: D, states: [{name: S, internal: "speed = min(speed + 1, 9);", stays: true}]}}
schedule: [boss, inner, driver]
"""


@pytest.mark.slow
def test_chaos_inside_states_of_chaos_shows_no_states():
    made, lines = guarded(NESTED, ["slow: G speed < 6"], {"speed": "5"})
    proof = proved(made, lines)
    assert (proof.exit_code, proof.machines) == (0, ("boss", "inner", "driver"))
    assert proof.result.exploration.states < 50


@pytest.mark.parametrize("asked", ["driver.finished", "driver@T", "sampled(car) > 0", "helper.ran"])
def test_what_machines_do_is_not_assumed(asked):
    lines = lines_of(f"assume a: G (car > 0 -> {asked})", "assume b: G F car > 0", "p: G speed < 6")
    (found,) = unfit_assumptions(lines.assumptions, resolve(draft_of(powers({}))))
    assert (unfit(*found).code, unfit(*found).span.text) == ("E438", asked.removesuffix(" > 0"))
