"""How far clocks count: to the first tick beyond the largest value that a state compares them with."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import Problem
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.program import Int, Program

TEXT = """
name: t
cycle_ms: 100
whiteboard: {{n: {{type: 0..3}}, k: {{type: -2..5}}, b: {{type: bool}}, i: {{type: int}},
  d: {{type: {{decimal: 0.1, range: 0.0..1.1}}}}, t: {{type: {{decimal: 0.1, range: 0.0..104857.0}}}}}}
machines:
  m:
    inline:
      machine: M
      states:
        - {{name: A, transitions: [{{when: "{0}", to: B}}]}}
        - {{name: B, transitions: [{{when: "after(0.1)", to: A}}], on_exit: "{1}"}}
schedule: [m]
"""


def program(guard: str, body: str = "") -> Program:
    return Problem(load_arrangement_text(TEXT.format(guard, body))).program()


def clock(guard: str, body: str = "") -> int:
    (found,) = (v for v in program(guard, body).vars if v.name == "m.$clock")
    assert isinstance(found.type, Int) and (found.type.low, found.init) == (0, 0)
    return found.type.high


@pytest.mark.parametrize(
    ("guard", "ticks"),
    [
        ("after(0.3)", 3),
        ("after_ms(299)", 2),
        ("after_ms(301)", 3),
        ("after(n)", 30),
        ("after_ms(n)", 1),  # the other state's
        ("after(n + k)", 80),
        ("after(n - k)", 50),
        ("after(n * k)", 150),
        ("after(k / 2)", 20),
        ("after(k % 3)", 20),
        ("after(-k)", 20),
        ("after(abs(k))", 50),
        ("after(min(n, k))", 30),
        ("after(max(n, k))", 50),
        ("after(b ? n : k)", 50),
        ("after(b ? n : 7)", 70),
        ("b && after(n) || after(2 * n)", 60),
        ("after(floor(d))", 10),
        ("after(ceil(d))", 20),
        ("after(floor(sqrt(k)))", 20),
        ("after_ms(104857600)", 1 << 20),
        ("after(ceil(t))", 1048570),
    ],
)
def test_a_clock_stops_beyond_the_largest_bound(guard: str, ticks: int) -> None:
    assert clock(guard) == ticks + 1


def test_actions_read_the_clock_too() -> None:
    assert clock("b", "if (after(0.9)) { n = 1; }") == 10


def refused(text: str) -> Diagnostic:
    with pytest.raises(DiagnosticError) as raised:
        Problem(load_arrangement_text(text)).program()
    (found,) = raised.value.diagnostics
    return found


@pytest.mark.parametrize(
    ("guard", "message"),
    [
        ("after(104857.7)", "the bound 104857700 ms is 1,048,577 cycles of 100 ms, more than 1,048,576"),
        ("after(n * 100000)", "the bound 300000000 ms is 3,000,000 cycles of 100 ms, more than 1,048,576"),
        ("after(1000000000000000)", "the bound 1000000000000000000 ms is far too many cycles, more than 1,048,576"),
        ("after(i)", "the largest value of this bound is not known"),
    ],
)
def test_times_that_are_too_long_are_refused(guard: str, message: str) -> None:
    found = refused(TEXT.format(guard, ""))
    assert (found.code, found.message) == ("E093", message)
    known = guard != "after(i)"
    hint = (
        "use a longer cycle or a shorter time"
        if known
        else "use variables with a declared range in it, such as `0..60`"
    )
    assert found.hint == hint
    assert found.span is not None and found.span.text == guard


def test_a_time_that_is_never_positive_needs_no_long_clock() -> None:
    assert clock("after(min(k, -100000000))") == 2


def test_a_snapshot_of_a_cycle_needs_one_process() -> None:
    text = TEXT.format("b", "").replace(
        "schedule: [m]", "processes: {one: [m], two: [other]}\nprofile: {snapshot: cycle}"
    )
    other = "  other: {inline: {machine: K, states: [{name: A}]}}\nprocesses"
    found = refused(text.replace("processes", other, 1))
    assert (found.code, found.hint) == (
        "E085",
        "several processes have no common cycle: use `snapshot: ringlet`, or `changes: cycle` on the inputs",
    )
    assert found.span is not None
    assert (found.message, found.span.text) == ("`snapshot: cycle` needs a single process", "cycle")
