"""Bounded model checking against the explicit engine: the same violations, none longer than it need be."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.smt.arithmetic import Arithmetic, Integers
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.bounded.engine import BoundedSession
from llfsm_verify.engines.unrolled import runs
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.formula import is_plain
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.verification import harness
from llfsm_verify.verification.verify import verify
from tests.checking.problems import problems
from tests.quick import AtLeast, examples, many, spread

DEPTH = 9


def bmc(problem: Problem, options: Options, arithmetic: Arithmetic | None = None) -> Result:
    """What bounded model checking says, with this theory of numbers."""
    return harness.check("bmc", lambda given: BoundedSession(given, arithmetic), problem, options)


def compare(problem: tuple[Arrangement, PropertySet], integers: bool, tables: bool, tally: Counter[str]) -> None:
    """`tables` False: no monitor is written out, and formulas have to do with their encoding."""
    arrangement, lines = problem
    explicit = verify(arrangement, lines, Options(Limits(max_states=600)), engine="explicit")
    if not explicit.complete:
        tally["too large"] += 1
        return
    with patch.object(runs, "MAX_BITS", 10 if tables else 0):
        bounded = bmc(
            bind(arrangement, lines), Options(own=(UnrolledOptions(depth=DEPTH),)), Integers() if integers else None
        )
    if any("10,000 bits" in (p.reason or "") for p in bounded.properties):
        tally["too many bits"] += 1
        return
    for ours, theirs, line in zip(bounded.properties, explicit.properties, lines.goals, strict=True):
        assert ours.verdict in (Verdict.VIOLATED, Verdict.UNKNOWN)
        if ours.verdict is Verdict.VIOLATED:
            assert theirs.verdict is Verdict.VIOLATED, ours.text
            tally["violated"] += 1
            tally["lasso"] += ours.trace.loop is not None
        else:
            assert ours.reason is not None
            asked = tables or ours.kind == "ltl"  # a rule without a table is not looked at
            assert ("no run of up to" in ours.reason) is asked, ours.reason
            assert ours.reason.startswith("no") or not tables
        shown = theirs.trace is not None and theirs.trace.loop is not None
        if not tables and not (ours.kind == "ltl" and is_plain(line.formula) and shown):
            continue  # what cannot be written out is not looked for; of bad prefixes only those that show why
        if theirs.verdict is Verdict.VIOLATED and len(theirs.trace.steps) <= DEPTH:
            assert ours.verdict is Verdict.VIOLATED, (ours.text, theirs.trace)
            if theirs.trace.loop is None:
                assert ours.trace.loop is None and len(ours.trace.steps) == len(theirs.trace.steps)
            else:
                # Bits that the search does not keep may take the executor once more around the loop.
                assert ours.trace.loop is not None
                assert len(ours.trace.steps) <= 2 * len(theirs.trace.steps)
    found = {f.site: len(f.trace.steps) for f in bounded.faults.findings}
    for finding in explicit.faults.findings:
        if len(finding.trace.steps) <= bounded.exploration.depth:  # it ends early where every property is violated
            assert found[finding.site] == len(finding.trace.steps)
            tally["fault"] += 1
    assert bool(found) <= (explicit.faults.verdict is Verdict.VIOLATED)


def run(count: int, least: dict[str, int]) -> Counter[str]:
    """Compare that many, and more until there are so many of each kind."""
    tally: Counter[str] = Counter()
    met = AtLeast(tally, least)
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(lambda *drawn: compare(*drawn, tally), amount, problems(), st.booleans(), st.booleans(), size=4, until=met)
    return tally


@pytest.mark.slow
def test_random_arrangements() -> None:
    count = examples(30)
    run(count, {"violated": count // 6 + 1})


@pytest.mark.long
def test_many_random_arrangements() -> None:
    run(many(600), {"violated": 1, "lasso": 1, "fault": 1})


def test_a_monitor_of_too_many_letters_is_not_written_out():
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p.ltl", "enforce order: (ew@RED ew@GREEN ew@AMBER)*")])
    with patch.object(runs, "MAX_BITS", 2):
        [found] = bmc(bind(lights, lines), Options(own=(UnrolledOptions(depth=2),))).properties
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, "the automaton has more than 4 letters")


@pytest.mark.parametrize(
    ("options", "asked"), [(Options(), False), (Options(strict=True), True), (Options(vacuity="all"), True)]
)
def test_the_result_says_whether_vacuity_was_asked_for(options, asked):
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p.ltl", "F ew@GREEN")])
    result = bmc(bind(lights, lines), replace(options, own=(UnrolledOptions(depth=1),)))
    assert (result.strict, result.asked_vacuity) == (options.strict, asked)


def test_what_is_always_true_may_be_assumed():
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p.ltl", "assume a: true\np: F G ew@RED")])
    [found] = bmc(bind(lights, lines), Options(own=(UnrolledOptions(depth=6),))).properties
    assert found.verdict is Verdict.UNKNOWN
    assert found.reason is not None and found.reason.startswith("no run of up to 6 steps violates it")
