"""What is found in a part of the graph: shortest all the same, and searches given up for smaller ones."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.verdict import Options, Progress, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit import engine as explicit
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

WIDE = """
name: wide
whiteboard:
  k: {type: 0..99, role: input}
  u: {type: 0..99}
  v: {type: 0..99}
  f: {type: bool}
machines:
  m: {inline: {machine: M, states: [{name: S, internal: "f = u == 99 && v == 99 && k == 99; u = v; v = k;",
      transitions: [{when: "false", to: S}]}]}}
schedule: [m]
"""

COUNTERS = """
name: counters
whiteboard:
  b: {type: bool}
  far: {type: 0..99}
  go: {type: bool, role: input}
machines:
  m: {inline: {machine: M, states: [{name: S, internal: "b = !b; ACTION", transitions: [{when: "false", to: S}]}]}}
schedule: [m]
"""


@pytest.mark.slow
@pytest.mark.parametrize("chains", ["on", "off"])
def test_a_bad_prefix_found_early_is_a_shortest_one(chains):
    properties = parse_properties([Source("p.ltl", "q: G !f && !(X X X X X X X X X m@S)")])
    result = verify(
        load_arrangement_text(WIDE), properties, Options(own=(ExplicitOptions(compression=chains),)), engine="explicit"
    )
    trace = result.properties[0].trace
    assert trace is not None and len(trace.steps) == 3


@pytest.mark.parametrize(("action", "left_out"), [("if (go) { far = (far + 1) % 100; }", ("far", "go")), ("", ())])
def test_the_cone_is_taken_where_it_leaves_something_out(monkeypatch, action, left_out):
    monkeypatch.setattr(explicit, "REDUCE_FROM", 100)
    properties = parse_properties([Source("p.ltl", "q: G F b\nr: G !b")])
    shown: list[Progress] = []
    text = COUNTERS.replace("ACTION", action)
    result = verify(
        load_arrangement_text(text),
        properties,
        Options(progress=shown.append, own=(ExplicitOptions(compression="off"),)),
        engine="explicit",
    )
    assert [p.verdict for p in result.properties] == [Verdict.HOLDS, Verdict.VIOLATED]
    assert result.exploration.left_out == left_out and result.complete
    assert "performing a run that violates r" in {p.doing for p in shown}


def test_sizes_are_those_of_the_largest_search(monkeypatch):
    monkeypatch.setattr(explicit, "REDUCE_FROM", 50)

    text = COUNTERS.replace("ACTION", "if (go) { far = (far + 1) % 100; }")
    properties = parse_properties([Source("p.ltl", "q: G F b")])

    seen: list[tuple[int, int]] = []

    def interrupt_the_next(self: object, explorer: Explorer) -> bool:
        seen.append((explorer.graph.configurations, explorer.graph.transitions))
        monkeypatch.setattr(Explorer, "explore", interrupted)
        return True

    monkeypatch.setattr(explicit.ExplicitSession, "_varies", interrupt_the_next)
    result = verify(
        load_arrangement_text(text), properties, Options(own=(ExplicitOptions(compression="off"),)), engine="explicit"
    )
    assert result.interrupted and not result.complete
    assert [
        (result.exploration.states, result.exploration.transitions)
    ] == seen and 50 <= result.exploration.states < 200
    assert result.properties[0].verdict is Verdict.UNKNOWN


def interrupted(self: object, target: int | None) -> None:
    raise KeyboardInterrupt


def test_after_the_time_limit_what_was_explored_is_looked_at_for_a_moment(monkeypatch):
    """Each look takes 0.3 s here: two fit."""
    seconds, looked = 0.0, []
    look, explore = Search._violation, Explorer.explore

    def looks(search, task, *rest):
        nonlocal seconds
        seconds += 0.3
        looked.append(task.name)
        return look(search, task, *rest)

    def explores(explorer, *rest):
        nonlocal seconds
        explore(explorer, 500)
        seconds = max(seconds, 5.1)
        explore(explorer, *rest)

    monkeypatch.setattr(Search, "_violation", looks)
    monkeypatch.setattr(Explorer, "explore", explores)
    monkeypatch.setattr(Budget, "seconds", property(lambda _: seconds))
    properties = parse_properties([Source("p.ltl", "p: G !f\nq: G v < 50\nr: G v < 60\ns: G u < 70")])
    result = verify(load_arrangement_text(WIDE), properties, Options(Limits(timeout=5.0)), engine="explicit")
    assert looked == ["p", "q"]
    assert [p.verdict for p in result.properties] == [Verdict.UNKNOWN, Verdict.VIOLATED, *[Verdict.UNKNOWN] * 2]
    assert {p.reason for p in result.properties} == {None, "the time limit of 5 s was reached"}
