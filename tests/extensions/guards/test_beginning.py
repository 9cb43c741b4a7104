"""Monitors of guards know the initial letter, which they have no turn to read."""

from __future__ import annotations

import pytest

from tests.extensions.guards.helpers import guarded, proved

TIMER = """\
name: timer
cycle_ms: 100
whiteboard:
  button: {type: bool, role: input}
  left: {type: 0..3}
  motor: {type: bool, role: output}
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          internal: "if (button) left = 3; else if (left > 0) left--; motor = true;"
          stays: true
schedule: [m]
"""
LINE = "off: G (left == 0 -> X X !motor)"


@pytest.mark.slow
def test_what_was_so_at_first_counts():
    """`left` is 0 at first, so the motor is off in the second cycle, which the monitor sees first."""
    made, lines = guarded(TIMER, [LINE], {"motor": "false"})
    assert proved(made, lines).exit_code == 0


@pytest.mark.slow
def test_a_monitor_that_begins_anew_knows_nothing_of_it():
    made, lines = guarded(TIMER, [LINE], {"motor": "false"}, until="button")
    assert proved(made, lines).exit_code == 1


@pytest.mark.slow
def test_what_differs_at_first_is_not_known():
    """The button is down forever or never: the monitor does not know the initial letter, and is a cycle too late."""
    free = TIMER.replace("role: input}", "role: input, changes: never}")
    made, lines = guarded(free, ["held: G (button -> X motor)"], {"motor": "true"})
    assert proved(made, lines).exit_code == 1
