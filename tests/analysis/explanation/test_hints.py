"""Notes below a trace: a clock that is a cycle later than people think."""

from __future__ import annotations

import re

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

ROAD = """
name: road
cycle_ms: {period}
whiteboard: {{call: {{type: bool, role: input}}, lamp: {{type: bool}}}}
machines:
  road:
    inline:
      machine: Road
      states:
        - {{name: GREEN, transitions: [{{when: call, to: AMBER}}]}}
        - {{name: AMBER, transitions: [{{when: {clock}, to: RED}}]}}
        - {{name: RED, on_entry: lamp = true;, transitions: [{{when: not call, to: GREEN}}]}}
schedule: [road]
"""


def checked(clock: str, period: int, goal: str) -> tuple[Verdict, list[str]]:
    arrangement = load_arrangement_text(ROAD.format(clock=clock, period=period), "road.yaml")
    (found,) = verify(arrangement, parse_properties([Source("p.ltl", f"p: {goal}")]), engine="explicit").properties
    return found.verdict, [note for note in found.notes if "after" in note]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clock", "period", "time", "cycles"),
    [("after(3)", 1000, "3 s", 4), ("after_ms(500)", 100, "500 ms", 6), ("call || after(0.2)", 200, "200 ms", 2)],
)
def test_the_note_says_after_how_many_cycles_a_clock_is_true(clock, period, time, cycles):
    """The executor says so as well: the transition fires that many cycles after the first turn, which is one after the
    machine came, and no bound that is shorter holds."""
    shown = re.search(r"after\S+", clock)
    assert shown is not None
    unit = f"{period // 1000} s" if period % 1000 == 0 else f"{period} ms"
    since = f"is true when more than {time} have passed since its first turn there, a cycle after it came"
    note = f"`{shown[0]}` of `road@AMBER` {since}: {cycles:,} cycles of {unit} later, not {cycles - 1:,}"
    for bound, notes in ((cycles + 1, []), (cycles, [note]), (cycles - 1, [note]), (cycles - 2, [])):
        verdict = Verdict.HOLDS if bound > cycles else Verdict.VIOLATED  # a bound below the clock's time is no slip
        assert checked(clock, period, f"G (rose(road@AMBER) -> F[<={bound * period}ms] road@RED)") == (verdict, notes)


@pytest.mark.parametrize(
    ("clock", "goal"),
    [
        ("after(0.25)", "G (rose(road@AMBER) -> F[<=300ms] road@RED)"),  # it is between two cycles
        ("after(0.3)", "G !road@RED"),  # no bound in time
        ("after(0.3)", "G (call -> F[<=500ms] !call)"),  # no cause speaks of the machine
        ("call", "G (rose(road@AMBER) -> F[<=300ms] road@RED)"),
    ],
)
def test_there_is_no_note_where_no_clock_decides(clock, goal):
    assert checked(clock, 100, goal) == (Verdict.VIOLATED, [])


def test_what_a_cause_reads_may_be_written_by_the_machine():
    verdict, (note,) = checked("after(0.3)", 100, "G (rose(road@AMBER) -> F[<=400ms] lamp)")
    assert verdict is Verdict.VIOLATED and note.startswith("`after(0.3)` of `road@AMBER` is true")
