"""A wrong answer of the search does not get past its confirmation, and saved runs are judged anew."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule, perform
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement, Source
from llfsm_verify.engines.explicit import search as searching
from llfsm_verify.kripke.product_search import Walk
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.verification.replay import replay

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
        - {name: B, on_entry: "", transitions: [{when: not go, to: A}]}
schedule: [m]
"""


def schedule(trace: Trace) -> Schedule:
    moves = [Move(None if s.process is None else 0, {x.choice: x.value for x in s.choices}) for s in trace.steps]
    return Schedule(trace.initial_free, tuple(moves), trace.loop)


def test_a_lasso_that_satisfies_the_property_is_refused(check, monkeypatch: pytest.MonkeyPatch) -> None:
    found = searching.accepting_lasso

    def wrong(graph, first, readers, fair):
        return found(graph, first, [], fair)

    monkeypatch.setattr(searching, "accepting_lasso", wrong)
    with pytest.raises(Disagreement, match="satisfies the property"):
        check(TOGGLE, "a: F (m@A || m@B)\nassume x: true")


def test_a_lasso_that_breaks_an_assumption_is_refused(check, monkeypatch: pytest.MonkeyPatch) -> None:
    found = searching.accepting_lasso
    monkeypatch.setattr(searching, "accepting_lasso", lambda g, f, r, x: found(g, f, r[1:], x))
    with pytest.raises(Disagreement, match="does not satisfy an assumption"):
        check(TOGGLE, "assume x: G F go\na: F m@B")


def test_a_prefix_that_is_not_bad_is_refused(check, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searching, "shortest_bad_prefix", lambda *a: Walk((0,), ()))
    with pytest.raises(Disagreement, match="could still go on"):
        check(TOGGLE, "a: G !m@B")


def test_letters_that_the_executor_does_not_show_are_noticed(check, monkeypatch: pytest.MonkeyPatch) -> None:
    found = searching.shortest_bad_prefix

    def wrong(*arguments):
        walk = found(*arguments)
        return Walk(walk.nodes, tuple(x ^ 1 for x in walk.letters), walk.loop)

    monkeypatch.setattr(searching, "shortest_bad_prefix", wrong)
    with pytest.raises((Disagreement, KeyError)):
        check(TOGGLE, "a: G !m@B")


def test_a_saved_run_fails_again_passes_when_mended_and_misfits_when_it_asks_for_other_inputs(check) -> None:
    text = "a: G (m@B -> X m@B)"
    trace = check(TOGGLE, text).properties[0].trace
    assert trace is not None
    properties = parse_properties([Source("p", text)])

    def again(changed: str) -> str:
        return replay(load_arrangement_text(changed, "t.yaml"), properties, schedule(trace)).outcome

    assert again(TOGGLE) == "fails"
    assert again(TOGGLE.replace("{when: not go, to: A}", '{when: "false", to: A}')) == "passes"
    assert again(
        TOGGLE.replace("go: {", "stop: {type: bool, role: input}\n  go: {").replace("when: go", "when: stop")
    ) == ("misfit")


@pytest.mark.parametrize(
    "text", ["F G rose(go)", "F (rose(go) && X rose(go))", "G (rose(m@B) -> F (rose(go) && fell(go)))"]
)
def test_a_saved_run_fails_again_where_edges_contradict_each_other(check, text: str) -> None:
    trace = check(TOGGLE, f"a: {text}").properties[0].trace
    assert trace is not None
    properties = parse_properties([Source("p", f"a: {text}")])
    assert replay(load_arrangement_text(TOGGLE, "t.yaml"), properties, schedule(trace)).outcome == "fails"


def test_a_saved_lasso_is_evaluated_on_its_loop(check) -> None:
    text = "assume busy: G F go\na: F G m@A"
    trace = check(TOGGLE, text).properties[0].trace
    assert trace is not None
    assert trace.loop is not None
    properties = parse_properties([Source("p", text)])
    toggle = load_arrangement_text(TOGGLE, "t.yaml")
    assert replay(toggle, properties, schedule(trace)).outcome == "fails"
    still = Schedule((), (Move(0, {"go": 0}),), 0)
    assert replay(toggle, properties, still).outcome == "passes"
    assert "assumption" in replay(toggle, properties, still).reason


def test_a_saved_fault_happens_again_or_does_not() -> None:
    text = TOGGLE.replace("whiteboard:", "whiteboard:\n  n: {type: 0..1, init: 0}").replace(
        'on_entry: ""', "on_entry: n++;"
    )
    run = Schedule((), tuple(Move(0, {"go": i % 2 == 0}) for i in range(4)), None)
    nothing = parse_properties([Source("p", "")])
    assert replay(load_arrangement_text(text, "t.yaml"), nothing, run, ("F001", "")).outcome == "fails"
    assert replay(load_arrangement_text(TOGGLE, "t.yaml"), nothing, run, ("F001", "")).outcome == "passes"
    assert replay(load_arrangement_text(text, "t.yaml"), nothing, run, ("F002", "")).outcome == "misfit"


def test_a_mended_fault_passes_though_its_last_step_now_reads_more(check) -> None:
    """Found by a newcomer: the step that faulted never came to read what the mended one reads."""
    text = """
name: mended
whiteboard: {n: {type: 0..1, init: 1}, go: {type: bool, role: input}}
machines:
  m: {inline: {machine: M, states: [{name: A, on_entry: n++;, transitions: [{when: go, to: A}]}]}}
schedule: [m]
profile: clfsm
"""
    (finding,) = check(text).faults.findings
    nothing = parse_properties([Source("p", "")])
    run = schedule(finding.trace)
    assert run.ringlets[-1].choices == {}
    assert replay(load_arrangement_text(text, "t.yaml"), nothing, run, ("F001", "")).outcome == "fails"
    mended = load_arrangement_text(text.replace("n++", "n = 0"), "t.yaml")
    assert replay(mended, nothing, run, ("F001", "")).outcome == "passes"


def test_assumptions_that_no_run_satisfies_are_noted(check) -> None:
    (found,) = check(TOGGLE, "assume x: G F go && F G !go\na: G !m@B").properties
    assert (found.verdict.value, found.notes) == ("unknown", ())
    assert "no run satisfies the assumptions" in (found.reason or "")
    (found,) = check(TOGGLE, "assume x: G F go\na: G (m@A || m@B)").properties
    assert found.notes == ()


COUNTER = """
name: counter
whiteboard:
  n: {type: 0..3}
machines:
  m:
    inline:
      machine: C
      states:
        - {name: A, internal: "n = n + 1;", stays: true}
schedule: [m]
"""


def test_a_loop_ends_with_its_fault() -> None:
    arrangement = load_arrangement_text(COUNTER, "counter.yaml")
    execution = Execution(bind(arrangement, PropertySet()).program())
    again = perform(execution, Schedule((), (Move(0, {}),), 0), frozenset())
    assert again.trace.fault is not None and again.trace.fault.code == "F001"
    assert len(again.trace.steps) == 4 and again.trace.loop is None
