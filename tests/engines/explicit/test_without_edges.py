"""Properties of large spaces, whose edges are not stored, or only those that matter: the same answers as with edges."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.safety import is_invariant
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit import engine as explicit
from llfsm_verify.engines.explicit.options import ExplicitOptions, When
from llfsm_verify.kripke import narrow
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product_search import Projection, Reader
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import atoms
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many

LIMITS = Limits(max_states=3_000)


INVARIANTS = ("G !({a} && {b})", "G ({a} -> {b})", "!F {a}", "G {a} && G !({b})", "G ({a} || !({b}))")
WAITING = ("G ({a} -> F {b})", "G F {a}", "G ({a} -> F ({b} || !({a})))", "G F {a} || G F {b}", "G ({a} -> F (G {b}))",
           "G ({a} -> X F {b})", "G F ({a} && F {b})", "G ({a} -> F ({b} && F {a}))")  # fmt: skip


@st.composite
def problems(draw: st.DrawFn, *more: str) -> tuple[Arrangement, PropertySet]:
    arrangement = build_arrangement(draw(arrangements(max_machines=3, max_states=3)))
    atom = atoms(arrangement)
    lines = []
    for i in range(draw(st.integers(1, 3))):
        a, b = draw(atom), draw(atom)
        lines.append(f"p{i}: " + draw(st.sampled_from([*INVARIANTS, *more])).format(a=a, b=b))
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def answers(result: Result, *, exact: bool) -> tuple[object, ...]:
    """`exact`: traces are shortest ones, which are not always those that chains lead to."""
    return (
        tuple((p.name, p.verdict, p.vacuity, exact and p.trace and len(p.trace.steps)) for p in result.properties),
        result.faults.verdict,
        tuple((f.site.code, exact and f.trace and len(f.trace.steps)) for f in result.faults.findings),
        (result.exploration.states, result.exploration.transitions),
    )


def same_without_edges(problem: tuple[Arrangement, PropertySet], compression: When, cone: When) -> None:
    arrangement, lines = problem
    options = Options(LIMITS, own=(ExplicitOptions(compression=compression, cone=cone),), vacuity="all")
    whole = verify(arrangement, lines, options, engine="explicit")
    if not whole.complete:
        event("too large")
        return
    dropped: list[Graph] = []

    def drop(graph: Graph) -> None:
        dropped.append(graph)
        drops(graph)

    drops = Graph.drop_edges
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explicit, "REDUCE_FROM", 2)
        patch.setattr(narrow, "MOST_KEPT", 1)
        patch.setattr(Graph, "drop_edges", drop)
        reduced = verify(arrangement, lines, options, engine="explicit")
    some = any(graph.is_narrow for graph in dropped)
    event("some edges are stored" if some else "no edges are stored" if dropped else "edges are stored")
    assert answers(reduced, exact=compression == "off") == answers(whole, exact=compression == "off")


choices = st.sampled_from(["off", "on"])


@pytest.mark.slow
@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems(), choices, choices)
def test_an_invariant_needs_no_edges(problem: tuple[Arrangement, PropertySet], compression: When, cone: When) -> None:
    same_without_edges(problem, compression, cone)


@pytest.mark.slow
@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems(*WAITING, *WAITING), st.just("off"), choices)
def test_where_an_automaton_waits_no_edges_are_needed(
    problem: tuple[Arrangement, PropertySet], compression: When, cone: When
) -> None:
    same_without_edges(problem, compression, cone)


@pytest.mark.long
@settings(max_examples=many(1500), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems(*WAITING, *WAITING), st.just("off"), choices)
def test_where_an_automaton_waits_no_edges_are_needed_at_length(
    problem: tuple[Arrangement, PropertySet], compression: When, cone: When
) -> None:
    same_without_edges(problem, compression, cone)


@pytest.mark.long
@settings(max_examples=many(1500), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(problems(), choices, choices)
def test_an_invariant_needs_no_edges_at_length(
    problem: tuple[Arrangement, PropertySet], compression: When, cone: When
) -> None:
    same_without_edges(problem, compression, cone)


def test_which_formulas_are_invariants() -> None:
    def said(text: str) -> bool:
        (line,) = parse_properties([Source("p.ltl", f"p: {text}")]).properties
        assert line.formula is not None
        return is_invariant(line.formula)

    assert said("G (a -> b)")
    assert said("!F (a && !b)")
    assert said("G G a && G (b <-> c)")
    assert said("false R a")
    assert not said("a")
    assert not said("G (a -> X b)")
    assert not said("G a || G b")
    assert not said("G F a")
    assert not said("F a")
    assert not said("G (a -> O b)")
    assert not said("G (a -> F[<=2s] b)")


COUNTERS = """
name: counters
whiteboard:
  go: {type: bool, init: false, role: input}
  n: {type: uint8, init: 0}
machines:
  counter:
    inline:
      machine: Counter
      states:
        - {name: A, transitions: [{when: go, to: B}]}
        - {name: B, on_entry: n = n + 1;, transitions: [{when: n < 200, to: A}]}
schedule: [counter]
"""


@pytest.mark.slow
@pytest.mark.parametrize("compression", ["off", "on"])
def test_what_needs_edges_after_all_explores_again(monkeypatch: pytest.MonkeyPatch, compression: When) -> None:
    monkeypatch.setattr(explicit, "REDUCE_FROM", 100)
    arrangement = load_arrangement_text(COUNTERS)
    options = Options(own=(ExplicitOptions(compression=compression),), witnesses=True, traces=2)
    lines = "low: G (counter@B -> n <= 200)\nlower: G (counter@B -> n < 150)"
    result = verify(arrangement, parse_properties([Source("p.ltl", lines)]), options, engine="explicit")
    low, lower = result.properties
    assert (low.verdict, lower.verdict) == (Verdict.HOLDS, Verdict.VIOLATED)
    assert low.vacuity is not None
    assert low.witness is not None
    assert lower.trace is not None
    assert lower.only is not None  # all its counterexamples go the same way


@pytest.mark.slow
def test_a_property_that_is_no_invariant_keeps_the_edges(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explicit, "REDUCE_FROM", 100)
    monkeypatch.setattr(Graph, "drop_edges", lambda _: pytest.fail("edges were dropped"))
    arrangement = load_arrangement_text(COUNTERS)
    lines = parse_properties([Source("p.ltl", "low: G (n <= 200)\nback: G (go -> go U counter@A)")])
    assert verify(arrangement, lines, engine="explicit").complete


def test_which_automata_wait() -> None:
    arrangement = load_arrangement_text(COUNTERS)

    def kept(text: str) -> list[int] | None:
        (goal,) = goals_of(bind(arrangement, parse_properties([Source("p.ltl", f"p: {text}")])))
        keeps = narrow.keeps_of(Reader(goal.violations(), Projection(range(len(goal.atoms)))))
        return None if keeps is None else [letter for letter in range(1 << len(goal.atoms)) if keeps(letter)]

    assert kept("G F counter@A") == [0]
    assert kept("G (counter@A -> F counter@B)") == [0, 1]
    assert kept("G (counter@A -> X F counter@B)") == [0, 1, 3]
    assert kept("G (counter@A -> F G counter@B)") is None  # it waits in its first state for what is not so now
    assert kept("F G counter@A") is None
    assert kept("F counter@A") is None
    begins_again = Automaton(("a",), ((Edge(0, 0, 0, 0), Edge(1, 0, 1, 0)), (Edge(0, 0, 0, 1),)), 1)
    assert narrow.keeps_of(Reader(begins_again, Projection([0]))) is None


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_some_edges_are_enough(monkeypatch: pytest.MonkeyPatch, jobs: int) -> None:
    """A lasso that is found late, and in part along edges that are not kept, is as short as with all edges."""
    arrangement = load_arrangement_text(COUNTERS)
    lines = parse_properties([Source("p.ltl", "late: G (n == 150 && counter@A -> F n != 150)\nlow: G F n <= 200")])
    options = Options(own=(ExplicitOptions(compression="off", cone="off", jobs=jobs),))
    whole = verify(arrangement, lines, options, engine="explicit")
    monkeypatch.setattr(explicit, "REDUCE_FROM", 100)
    narrowed: list[bool] = []
    narrows = Explorer.narrow
    monkeypatch.setattr(Explorer, "narrow", lambda *given: narrowed.append(narrows(*given)))
    reduced = verify(arrangement, lines, options, engine="explicit")
    assert narrowed == [True]
    assert answers(reduced, exact=True) == answers(whole, exact=True)
    assert [p.verdict for p in whole.properties] == [Verdict.VIOLATED, Verdict.HOLDS]
