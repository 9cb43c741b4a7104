"""Chains of steps without a choice: the same answers and counts as without, from fewer stored configurations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking import explicit, search
from llfsm_verify.checking.binding import bind
from llfsm_verify.checking.limits import Budget
from llfsm_verify.checking.searching import Search
from llfsm_verify.checking.verdict import Limits, Options, Result, Verdict
from llfsm_verify.checking.verify import verify
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke import chains as chains_module
from llfsm_verify.kripke.explore import Explorer, LimitReached
from llfsm_verify.kripke.kernels.chain_blocks import MAX_CHAIN
from llfsm_verify.kripke.memory import Region
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.json import result_object
from llfsm_verify.report.wording import summary_text
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.program import Program
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties

LIMITS = Limits(max_states=3_000)
CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
FAST = settings(max_examples=100, suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink])
SLOW = settings(FAST, max_examples=2_000)

Problem = tuple[Arrangement, PropertySet]


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """Arrangements whose ringlets are observed, and one or two properties, perhaps with an assumption."""
    document = draw(arrangements(max_machines=3, max_states=3))
    document.pop("observe", None)
    arrangement = build_arrangement(document)
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def answers(result: Result) -> tuple[object, ...]:
    return (
        tuple((p.name, p.verdict, p.trace, p.reason, p.notes) for p in result.properties),
        result.faults.verdict,
        tuple((f.site, f.trace) for f in result.faults.findings),
        (result.complete, result.states, result.transitions),
    )


def compared(problem: Problem, found: Counter[str]) -> None:
    arrangement, lines = problem
    off = verify(arrangement, lines, Options(LIMITS, cone="off", chains="off"))
    if not off.complete:
        return
    on = verify(arrangement, lines, Options(LIMITS, cone="off", chains="on"))
    assert answers(on) == answers(off)
    assert off.stored is None
    assert on.stored is not None
    assert on.counted
    assert on.stored <= on.states
    found["compared"] += 1
    found["fewer"] += on.stored < on.states
    found["half"] += 2 * on.stored <= on.states
    found.update(p.verdict.value for p in on.properties)
    found["faults"] += bool(on.faults.findings)


def same_answers(amount: settings) -> None:
    found: Counter[str] = Counter()

    @amount
    @given(problems())
    def run(problem: Problem) -> None:
        compared(problem, found)

    run()
    print(found)
    assert found["compared"] > 0.7 * amount.max_examples
    assert found["fewer"] > 0.25 * found["compared"]


def test_chains_change_no_answer() -> None:
    same_answers(FAST)


@pytest.mark.slow
def test_chains_change_no_answer_many() -> None:
    same_answers(SLOW)
