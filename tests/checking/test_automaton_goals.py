"""Automata from files as goals: which of them are known to be safety properties."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.reduction import closure_of
from llfsm_verify.checking.goals import automata
from llfsm_verify.checking.goals.automata import AutomatonGoal
from llfsm_verify.checking.replay.confirm import ReplayedRun
from llfsm_verify.diagnostics import Disagreement, Source
from llfsm_verify.logic.formula import Formula, apply, atom
from llfsm_verify.logic.properties import FEATURES, parse_properties

ALWAYS, AGAIN = apply("G", atom("p")), apply("G", apply("F", atom("p")))


def goal(formula: Formula, kind: str = "automaton") -> AutomatonGoal:
    (line,) = parse_properties([Source("t", f"{kind} a: a.hoa")], features=FEATURES)
    return AutomatonGoal(line, translate(formula))


@pytest.mark.parametrize(
    ("formula", "kind", "safe"),
    [
        (ALWAYS, "automaton", True),
        (AGAIN, "automaton", False),
        (apply("F", atom("p")), "automaton never", True),
        (ALWAYS, "automaton never", False),
    ],
)
def test_a_safety_property_is_known_as_one(formula: Formula, kind: str, safe: bool) -> None:
    assert goal(formula, kind).is_safe() is safe


def test_large_automata_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = goal(ALWAYS)
    allowed = asked.allowed()
    assert allowed is not None
    pairs = len(closure_of(allowed).edges) * len(asked.violations().edges)
    for most, safe in ((pairs, True), (pairs - 1, False)):
        monkeypatch.setattr(automata, "MAX_PAIRS", most)
        assert goal(ALWAYS).is_safe() is safe


def test_a_beginning_after_which_the_run_may_go_on_well_is_no_violation() -> None:
    def shown(*letters: frozenset[str], status: int = 0) -> ReplayedRun:
        return cast(ReplayedRun, SimpleNamespace(letters=letters, status=status))

    p, none = frozenset("p"), frozenset[str]()
    asked = goal(ALWAYS)
    asked.confirm_prefix(shown(none), "a")
    asked.confirm_prefix(shown(p, none), "a")
    with pytest.raises(Disagreement, match="a: the run shown could still go on to satisfy the property"):
        asked.confirm_prefix(shown(p), "a")
    with pytest.raises(Disagreement, match="the executor faults on the trace"):
        asked.confirm_prefix(shown(none, status=1), "a")
