"""With and without reductions: the same verdicts, and the same traces."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit import engine as explicit
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many

LIMITS = Limits(max_states=3_000)


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, PropertySet]:
    arrangement = build_arrangement(draw(arrangements(max_machines=3, max_states=3)))
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def answers(result: Result) -> tuple[object, ...]:
    return (
        tuple((p.name, p.verdict, p.trace, p.notes) for p in result.properties),
        result.faults.verdict,
        tuple((f.site.code, f.trace) for f in result.faults.findings),
    )


def same_in_the_cone(problem: tuple[Arrangement, PropertySet]) -> None:
    arrangement, lines = problem
    whole = verify(arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="off"),)), engine="explicit")
    if not whole.complete:
        event("too large")
        return
    reduced = verify(arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="on"),)), engine="explicit")
    event("something is left out" if reduced.exploration.left_out else "nothing is left out")
    assert answers(reduced) == answers(whole)
    assert reduced.exploration.states <= whole.exploration.states
    assert reduced.complete
    if not reduced.exploration.left_out:
        assert (reduced.exploration.states, reduced.exploration.transitions) == (
            whole.exploration.states,
            whole.exploration.transitions,
        )


@pytest.mark.slow
@settings(max_examples=examples(45), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems())
def test_the_cone_of_influence_changes_no_answer(problem: tuple[Arrangement, PropertySet]) -> None:
    same_in_the_cone(problem)


@pytest.mark.long
@settings(max_examples=many(2000), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems())
def test_the_cone_of_influence_changes_no_answer_at_length(problem: tuple[Arrangement, PropertySet]) -> None:
    same_in_the_cone(problem)


IDLE_COUNTER = """
name: beside
whiteboard:
  go: {type: bool, init: false, role: input}
  far: {type: uint8, init: 0}
machines:
  lamp:
    inline:
      machine: Lamp
      initial: OFF
      states:
        - {name: OFF, transitions: [{when: go, to: ON}]}
        - {name: ON, transitions: [{when: not go, to: OFF}]}
  counter:
    inline:
      machine: Counter
      initial: A
      states:
        - {name: A, internal: far = far + 1;, transitions: [{when: far == 200, to: B}]}
        - {name: B, internal: far = far + 2;, transitions: [{when: far < 10, to: A}]}
schedule: [lamp, counter]
"""


@pytest.mark.slow
def test_what_no_property_depends_on_is_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explicit, "REDUCE_FROM", 100)
    arrangement = load_arrangement_text(IDLE_COUNTER)
    lines = parse_properties([Source("p.ltl", "dark: G F lamp@OFF\nserved: G (lamp.ran && go -> F lamp@ON)")])
    result = verify(arrangement, lines, engine="explicit")
    assert result.complete
    assert "far" in result.exploration.left_out
    assert result.exploration.states < 20
    assert [p.verdict for p in result.properties] == [Verdict.VIOLATED, Verdict.HOLDS]
    whole = verify(arrangement, lines, Options(own=(ExplicitOptions(cone="off"),)), engine="explicit")
    assert whole.exploration.states > 500
    assert [p.verdict for p in whole.properties] == [Verdict.VIOLATED, Verdict.HOLDS]
