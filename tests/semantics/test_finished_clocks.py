"""A machine that has left the schedule forever has no clock."""

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.verdict import Options
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification.verify import verify

TICKING = """
name: ticking
cycle_ms: 100
whiteboard:
  b: {type: bool}
machines:
  m: {inline: {machine: M, states: [{name: S, internal: "b = !b;", transitions: [{when: "false", to: S}]}]}}
  n: {inline: {machine: N, states: [{name: S, internal: "if (after(60)) { b = false; }"}]}}
schedule: [m, n]
"""


def test_the_clock_of_a_finished_machine_stands_still():
    result = verify(load_arrangement_text(TICKING), PropertySet(()), Options(), engine="explicit")
    assert result.exploration.states <= 4
