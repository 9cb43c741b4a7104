"""Small arrangements, each with a sentence that says why it exists and verdicts that can be checked by hand."""

from __future__ import annotations

import time

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

TOGGLE = """
name: toggle
whiteboard:
  go: {type: bool, role: input}
machines:
  m:
    inline:
      machine: T
      states:
        - {name: A, transitions: [{when: go, to: B}]}
        - {name: B, transitions: [{when: not go, to: A}]}
schedule: [m]
"""


def test_an_input_is_free_and_its_fairness_is_assumed(verdicts) -> None:
    assert verdicts(TOGGLE, "a: G F m@B\nb: G (m@A || m@B)\nc: F m@B") == {
        "a": "violated", "b": "holds", "c": "violated", "faults": "holds",
    }  # fmt: skip
    assert verdicts(TOGGLE, "assume f: G F (m.ran && go)\na: F m@B\nb: G F m@A")["a"] == "holds"


def test_the_letter_shows_the_input_of_the_step_it_follows(verdicts) -> None:
    """M goes to B exactly when the sample of that very step was true; in c0 the input has its init, false."""
    found = verdicts(TOGGLE, "a: G (m.fired(A, 0) -> go)\nb: G (m@B -> go)\nc: G (m@A -> !go)\nd: !go")
    assert found == {"a": "holds", "b": "holds", "c": "holds", "d": "holds", "faults": "holds"}


UNREAD = """
name: unread
whiteboard:
  seen: {type: bool, role: input}
  other: {type: bool, role: input}
machines:
  m: {inline: {machine: T, states: [{name: A, transitions: [{when: seen, to: A}]}]}}
schedule: [m]
"""


def test_an_input_that_no_step_reads_is_free_in_every_letter(verdicts) -> None:
    found = verdicts(UNREAD, "a: G !other\nb: F other\nc: G F (other || !other)")
    assert found == {"a": "violated", "b": "violated", "c": "holds", "faults": "holds"}


ENDING = """
name: ending
whiteboard: {late: {type: bool, role: input}}
machines:
  m: {inline: {machine: T, states: [{name: A, transitions: [{when: "true", to: B}]}, {name: B}]}}
schedule: [m]
"""


def test_after_the_end_the_last_configuration_repeats_and_inputs_stay_free(check, verdicts) -> None:
    found = verdicts(ENDING, "a: F G m@B\nb: F G !m.ran\nc: F m.finished\nd: F G !late\ne: G F late\nf: F G !cycle")
    assert found == {
        "a": "holds", "b": "holds", "c": "holds", "d": "violated", "e": "violated", "f": "holds", "faults": "holds",
    }  # fmt: skip
    trace = check(ENDING, "G F m.ran").properties[0].trace
    assert trace is not None
    assert trace.steps[-1].process is None


FAULTY = """
name: faulty
whiteboard:
  up: {type: bool, role: input}
  n: {type: 0..3, init: 0}
machines:
  m:
    inline:
      machine: T
      states:
        - name: A
          internal: if (up) { n++; } else { n = 0; }
          transitions: [{when: n > 5, to: A}]
schedule: [m]
"""


def test_a_store_outside_its_range_is_a_fault_with_the_shortest_trace(check) -> None:
    result = check(FAULTY, "a: G n <= 3\nb: G n < 3")
    assert result.faults.verdict is Verdict.VIOLATED
    (finding,) = result.faults.findings
    assert finding.site.code == "F001"
    assert finding.site.span is not None
    assert finding.site.span.line == 12
    assert len(finding.trace.steps) == 4
    assert finding.trace.fault == finding.site
    assert finding.trace.steps[-1].changes == ()
    assert [p.verdict for p in result.properties] == [Verdict.HOLDS, Verdict.VIOLATED]
    bad = result.properties[1].trace
    assert bad is not None
    assert bad.loop is None
    assert len(bad.steps) == 3
    assert result.exit_code == 1


def test_a_bad_prefix_before_an_unavoidable_fault_counts(verdicts) -> None:
    text = FAULTY.replace("if (up) { n++; } else { n = 0; }", "n++;")
    found = verdicts(text, "a: G n < 2\nb: F n == 3\nc: G F n == 0\nassume x: G n >= 0\n")
    # with an assumption only infinite runs count, and this arrangement has none
    assert found == {"a": "unknown", "b": "unknown", "c": "unknown", "faults": "violated"}
    assert verdicts(text, "a: G n < 2")["a"] == "violated"


DIVISION = """
name: division
whiteboard: {{d: {{type: 0..3, role: input}}, q: {{type: int32, init: 0}}}}
machines:
  m:
    inline:
      machine: T
      states:
        - name: A
          internal: |
            q = d != 0 && 6 / d > {limit} ? 6 % d : 10 / (d - 2);
schedule: [m]
finished: keep
"""


def test_division_by_zero_is_found_behind_short_circuits_only_where_it_happens(check) -> None:
    """6 / d is evaluated only where d is not 0; d = 2 comes to 10 / (d - 2) only when 6 / 2 is not above the limit."""
    assert check(DIVISION.format(limit=2)).faults.verdict is Verdict.HOLDS
    (finding,) = check(DIVISION.format(limit=3)).faults.findings
    assert finding.site.code == "F002"
    assert finding.site.span is not None
    assert (finding.site.span.line, len(finding.trace.steps)) == (11, 1)
    assert [s.value for s in finding.trace.steps[0].sampled] == [2]


PROCESSES = """
name: two
{fairness}
machines:
  a: {{inline: {{machine: A, states: [{{name: X, transitions: [{{when: "true", to: Y}}]}}, {{name: Y, transitions: [{{when: "true", to: X}}]}}]}}}}
  b: {{inline: {{machine: B, states: [{{name: X, transitions: [{{when: "true", to: Y}}]}}, {{name: Y}}]}}}}
processes: {{left: [a], right: [b]}}
"""  # noqa: E501


@pytest.mark.parametrize(("fairness", "expected"), [("", "holds"), ("fairness: none", "violated")])
def test_each_live_process_goes_on_unless_fairness_is_dropped(verdicts, fairness: str, expected: str) -> None:
    """B may be starved forever; a may not, since b comes to its end."""
    found = verdicts(PROCESSES.format(fairness=fairness), "a: F b@Y\nb: G F a@Y\nc: F b.finished\nd: G !(a@Y && b@Y)")
    assert found == {"a": expected, "b": "holds", "c": expected, "d": "violated", "faults": "holds"}


UNTIMED = """
name: untimed
timing: untimed
whiteboard: {{back: {{type: bool, role: input}}}}
machines:
  m:
    inline:
      machine: T
      states:
        - name: A
          transitions: [{{when: back, to: {target}}}, {{when: after(1), to: B}}, {{when: after_ms(500), to: C}}]
        - {{name: B, transitions: [{{when: "false", to: B}}]}}
        - {{name: C, transitions: [{{when: "true", to: A}}]}}
schedule: [m]
"""


def test_untimed_every_timing_is_covered_and_time_passes(verdicts) -> None:
    """The earlier bound lies behind the later one in the list, so C is reached between the two; back is a self-loop."""
    props = "assume no_back: G !back\na: F (m@B || m@C)\nb: F m@B\nc: G !m@C\nd: G (m@C -> X !m@C)"
    found = verdicts(UNTIMED.format(target="A"), props)
    assert found == {"a": "holds", "b": "violated", "c": "violated", "d": "holds", "faults": "holds"}
    # leaving and coming back restarts the clock: time need not pass any more
    assert verdicts(UNTIMED.format(target="C"), "a: F m@B")["a"] == "violated"


TIMED = """
name: timed
cycle_ms: 100
machines:
  m:
    inline:
      machine: T
      states:
        - {name: A, transitions: [{when: after(0.2), to: B}]}
        - {name: B, transitions: [{when: after_ms(0), to: A}]}
schedule: [m]
"""


def test_after_is_strict_and_counts_cycles(verdicts) -> None:
    """Entered in cycle 0, the clock shows 300 > 200 in the fourth ringlet; 0 is not more than 0, but 100 is."""
    found = verdicts(TIMED, "a: X X X m@A\nb: X X X X m@B\nc: G (m@B -> X m@B || m.fired(B, 0) || X m@A)")
    assert (found["a"], found["b"]) == ("holds", "holds")
    found = verdicts(TIMED, "b: X X X X (m@B && X (m@B && X m@A))")
    assert found["b"] == "holds"


CYCLES = """
name: cycles
observe: cycle
whiteboard:
  go: {type: bool, role: input}
  n: {type: 0..2, init: 0}
machines:
  a: {inline: {machine: A, states: [{name: S, internal: n = 2;, transitions: [{when: "false", to: S}]}]}}
  b: {inline: {machine: B, states: [{name: S, internal: "n = go ? 1 : 0;", transitions: [{when: "false", to: S}]}]}}
schedule: [a, b]
"""


def test_between_the_ringlets_of_an_observed_cycle_nothing_is_seen(verdicts) -> None:
    found = verdicts(CYCLES, "a: G n != 2\nb: X G (n == 1 <-> go)\nc: X G (a.ran && b.ran && cycle)")
    assert found == {"a": "holds", "b": "holds", "c": "holds", "faults": "holds"}
    assert verdicts(CYCLES.replace("observe: cycle\n", ""), "a: G n != 2")["a"] == "violated"


NEVER = """
name: never
whiteboard: {jumper: {type: bool, role: input, changes: never}, n: {type: 0..1, init: 0}}
machines:
  m: {inline: {machine: T, states: [{name: A, internal: "n = jumper ? 1 : 0;", transitions: [{when: "false", to: A}]}]}}
schedule: [m]
"""


def test_an_input_that_never_changes_has_any_value_but_one(check, verdicts) -> None:
    result = check(NEVER, "a: G !jumper || G jumper\nb: G n == 0")
    assert [p.verdict.value for p in result.properties] == ["holds", "violated"]
    trace = result.properties[1].trace
    assert trace is not None
    assert trace.initial_free == (("jumper", 1),)
    assert verdicts(NEVER.replace("never}", "never, init: false}"), "b: G n == 0")["b"] == "holds"


COUNTER = """
name: counter
whiteboard: {n: {type: int, init: 0}, up: {type: bool, role: input}}
machines:
  m: {inline: {machine: T, states: [{name: A, internal: if (up) n = n * 3 + 1;, transitions: [{when: n < 0, to: A}]}]}}
schedule: [m]
"""


def test_leaving_64_bits_is_unknown_never_holds(check) -> None:
    result = check(COUNTER, "a: G n >= 0\nb: G n != 13")
    assert [p.verdict.value for p in result.properties] == ["unknown", "violated"]
    assert result.faults.verdict is Verdict.UNKNOWN
    assert not result.complete
    assert "64 bits" in (result.properties[0].reason or "")


def test_a_violation_near_the_start_of_an_endless_space_is_found(check) -> None:
    text = COUNTER.replace("n = n * 3 + 1", "n = n + 1")
    result = check(text, "b: G n != 13", Options(Limits(max_states=200_000)))
    (found,) = result.properties
    assert found.verdict is Verdict.VIOLATED
    assert found.trace is not None
    assert len(found.trace.steps) == 13
    assert result.exit_code == 1


@pytest.mark.parametrize("limits", [Limits(max_states=50), Limits(timeout=0.0), Limits(memory=1 << 20)])
def test_what_was_cut_short_is_unknown_and_says_why(check, limits: Limits) -> None:
    text = COUNTER.replace("n = n * 3 + 1", "n = n + 1")
    result = check(text, "a: G n >= 0", Options(limits))
    assert result.properties[0].verdict is Verdict.UNKNOWN
    assert "limit" in (result.properties[0].reason or "")
    assert result.faults.verdict is Verdict.UNKNOWN
    assert result.exit_code == 4


def test_an_assumption_that_no_run_satisfies_leaves_nothing_to_violate(verdicts) -> None:
    assert verdicts(TOGGLE, "assume x: false\na: G m@A")["a"] == "unknown"


def test_a_bad_prefix_counts_only_with_a_continuation_that_keeps_the_assumptions(check) -> None:
    props = "assume calm: G (m@B -> X G m@A)\na: G !m@B"
    (found,) = check(TOGGLE, props).properties
    assert found.verdict is Verdict.VIOLATED
    assert found.trace is not None
    assert found.trace.loop is not None
    (found,) = check(TOGGLE, "assume still: G m@A\na: G !m@B").properties
    assert found.verdict is Verdict.HOLDS


@pytest.mark.long
def test_more_atoms_than_bits_in_a_word(verdicts) -> None:
    text = TOGGLE.replace("whiteboard:", "whiteboard:\n  n: {type: 0..99, init: 0}").replace(
        "name: B,", "name: B, on_exit: n = 7;,"
    )
    found = verdicts(text, "a: G (" + " || ".join(f"n == {i}" for i in range(80)) + ")\nb: G (n == 0 || n == 9)")
    assert (found["a"], found["b"]) == ("holds", "violated")


@pytest.mark.slow
@pytest.mark.parametrize("observe", ["ringlet", "cycle"])
@pytest.mark.parametrize("limits", [Limits(timeout=1.0), Limits(max_states=1000)])
def test_limits_hold_inside_the_successors_of_one_configuration(check, observe: str, limits: Limits) -> None:
    text = f"observe: {observe}" + COUNTER.replace("up: {type: bool", "up: {type: int32").replace(
        "if (up) n = n * 3 + 1", "n = up"
    )
    used = time.process_time()
    result = check(text, "a: G n < 5", Options(limits))
    assert not result.complete
    assert time.process_time() - used < 30
    assert result.properties[0].verdict is not Verdict.HOLDS


def test_an_input_too_wide_to_enumerate_is_unknown_and_named(check, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.kripke.kernels.blocks.MAX_STEPS", 10_000)
    text = (
        TOGGLE.replace("go: {type: bool", "wide: {type: uint16")
        .replace("not go", "wide < 9")
        .replace("when: go", "when: wide > 9")
    )
    result = check(text, "a: G (m@A || m@B)", Options(own=(ExplicitOptions(labels=False),)))
    assert result.properties[0].verdict is Verdict.UNKNOWN
    assert "`wide` alone has 65536 values" in (result.properties[0].reason or "")


REMEMBERED = """
name: remembered
machines:
  c:
    inline:
      machine: C
      parameters: {m: machine}
      states:
        - {name: C0, transitions: [{when: "true", to: C1}]}
        - {name: C1, on_entry: resume(m);, transitions: [{when: m@B, to: C2}]}
        - {name: C2, on_entry: suspend(m);, transitions: [{when: m@S, to: C3}]}
        - {name: C3, on_entry: resume(m);, transitions: [{when: m@B, to: C4}]}
        - {name: C4, on_entry: restart(m);, transitions: [{when: m@S, to: C5}]}
        - {name: C5, on_entry: resume(m);, transitions: [{when: m@B, to: C6}]}
        - {name: C6, transitions: [{when: "false", to: C6}]}
    parameters: {m: m}
  m:
    inline:
      machine: M
      initial: S
      suspend: S
      states:
        - {name: S, transitions: [{when: not_yet, to: B}]}
        - {name: B, transitions: [{when: "false", to: S}]}
whiteboard: {not_yet: {type: bool, init: true}}
schedule: [c, m]
"""


@pytest.mark.parametrize("keep_all_bits", [False, True])
def test_a_restart_into_the_suspend_state_does_not_forget_what_suspend_remembered(
    verdicts, keep_all_bits: bool
) -> None:
    """Found by review: the initial state is the suspend state, so a machine can be suspended by a restart too."""
    once = REMEMBERED.replace("on_entry: suspend(m);", "on_entry: not_yet = false; suspend(m);").replace(
        "{name: C2, on_entry: not_yet = false; suspend(m);", '{name: C2, on_entry: "not_yet = false; suspend(m);"'
    )
    found = verdicts(once, "a: G !c@C6\nb: F c@C4", Options(keep_all_bits=keep_all_bits))
    assert found == {"a": "violated", "b": "holds", "faults": "holds"}


@pytest.mark.slow
def test_a_loop_longer_than_the_limit_of_ringlets_is_performed(check, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.checking.replay.confirm.MAX_UNROLLED", 10)
    text = TIMED.replace(
        "machines:", "whiteboard: {n: {type: uint8, init: 0}, z: {type: bool, init: false}}\nmachines:"
    )
    result = check(text.replace("name: A,", "name: A, on_entry: n++;,"), "a: F z")
    assert result.properties[0].verdict is Verdict.VIOLATED


def test_a_property_that_leaves_64_bits_at_once_is_unknown(check) -> None:
    text = COUNTER.replace("n: {type: int, init: 0}", "n: {type: int, init: 4294967295}")
    result = check(text, "a: G n * n > 5")
    assert result.properties[0].verdict is Verdict.UNKNOWN
    assert "64-bit" in (result.properties[0].reason or "")


FIRING = """
name: firing
observe: cycle
machines:
  a: {inline: {machine: A, states: [{name: S, transitions: [{when: "true", to: S}]}]}}
  b: {inline: {machine: B, states: [{name: S}]}}
schedule: [a, b]
finished: keep
"""


def test_a_trace_of_cycles_names_only_transitions_that_fired(check) -> None:
    """Found by random arrangements: `fired` of one ringlet was still set in the next one of the cycle."""
    trace = check(FIRING, "x: X F !a.ran").properties[0].trace
    assert trace is not None
    assert {(s.machine, s.fired) for s in trace.steps} == {("a", "S -> S when true"), ("b", None)}


RESUMED = """
name: resumed
timing: untimed
machines:
  c:
    inline:
      machine: C
      states:
        - {name: C0, transitions: [{when: "true", to: C1}]}
        - {name: C1, on_entry: resume(m);, transitions: [{when: "false", to: C1}]}
  m:
    suspended: true
    inline:
      machine: M
      states:
        - {name: S0, transitions: [{when: "true", to: S1}]}
        - {name: S1, on_resume: "if (after_ms(10)) late = true;", transitions: [{when: "true", to: S0}]}
whiteboard: {late: {type: bool, init: false}}
schedule: [c, m]
"""


@pytest.mark.parametrize("keep_all_bits", [False, True])
def test_the_executor_samples_no_age_that_the_search_has_not(verdicts, keep_all_bits: bool) -> None:
    """Found by random arrangements: time passed before a due action without text, which the search had forgotten."""
    found = verdicts(RESUMED, "a: F m@S1\nb: G !m@S1\nc: G !late", Options(keep_all_bits=keep_all_bits))
    assert found == {"a": "holds", "b": "violated", "c": "holds", "faults": "holds"}


EARLY = """
name: early
timing: untimed
whiteboard: {late: {type: bool, init: false}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: S0, on_entry: suspend(m);, transitions: [{when: "true", to: S1}]}
        - name: S1
          on_entry: if (after(1) || after_ms(5)) late = true;
          on_suspend: if (after_ms(10)) late = true;
          transitions: [{when: "true", to: S1}]
schedule: [m]
"""


def test_an_action_due_before_its_state_was_entered_reads_the_clock_of_the_state_before(verdicts) -> None:
    """Found by random arrangements: S1 is suspended before it is entered, so on_suspend sees how long S0 lasted."""
    found = verdicts(EARLY, "a: G !late\nb: G (m@__suspend -> G m@__suspend)")
    assert (found["a"], found["b"]) == ("violated", "holds")


def test_a_bad_prefix_is_found_where_the_automata_for_infinite_runs_are_too_large(
    check, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And without one the verdict is unknown, with the reason; never holds."""
    from llfsm_verify.automata.automaton import AutomatonTooLarge

    def refuse(*_arguments, **_options):
        raise AutomatonTooLarge("states", 4000)

    monkeypatch.setattr("llfsm_verify.automata.ltl.translation.translate", refuse)
    result = check(TOGGLE, "a: G !m@B && G F go\nb: G F m@A")
    assert [p.verdict.value for p in result.properties] == ["violated", "unknown"]
    assert "more than 4,000 states" in (result.properties[1].reason or "")


NESTED = """
name: nested
types: {Cell: {record: {x: 0..3, f: bool}}, Row: {array: Cell, size: 3}}
whiteboard:
  a: {type: {array: Row, size: 2}}
  i: {type: 0..2, role: input}
machines:
  m: {inline: {machine: M, states: [{name: S, internal: "a[1][i].x = i;", transitions: [{when: "false", to: S}]}]}}
schedule: [m]
"""


def test_elements_of_nested_arrays_are_shown_as_they_are_written(check) -> None:
    trace = check(NESTED, "p: G a[1][2].x == 0").properties[0].trace
    assert trace is not None
    assert [(c.variable, c.after) for s in trace.steps for c in s.changes] == [("a[1][2].x", "2")]
    assert dict(trace.initial)["a[0][1].f"] == "false"


def test_states_waiting_commands_and_ends_are_the_control_that_is_shown():
    last = {"machine": "L", "states": [{"name": "S", "transitions": [{"when": "b", "to": "E"}]}, {"name": "E"}]}
    boss = {"machine": "B", "states": [
        {"name": "S", "on_entry": "suspend(m);", "transitions": [{"when": "is_suspended(m)", "to": "T"}]},
        {"name": "T", "on_entry": "resume(m);", "transitions": [{"when": "false", "to": "T"}]},
    ]}  # fmt: skip
    document = {
        "whiteboard": {"b": {"type": "bool", "role": "input"}},
        "machines": {"m": {"inline": last}, "boss": {"inline": boss}},
        "schedule": ["boss", "m"],
    }
    lines = parse_properties([Source("p", "never: G !m.finished")])
    (found,) = verify(build_arrangement(document), lines, Options(), "explicit").properties
    changes = [(c.variable, c.before, c.after) for step in found.trace.steps for c in step.changes]
    assert {("m.pending", "none", "suspend"), ("m.pending", "none", "resume")} <= set(changes)
    assert changes[-1] == ("m.finished", "false", "true")
    assert {name for name, _, _ in changes} <= {"m", "boss", "m.pending", "m.finished"}
