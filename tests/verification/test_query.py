"""Queries of random state formulas: two engines give the same answer, with runs of the same length."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.verification.query import ask, parse_query
from tests.quick import examples

DEPTH = 6


@pytest.mark.slow
@settings(max_examples=examples(10), deadline=None, suppress_health_check=list(HealthCheck))
@given(arrangements(max_machines=2, max_states=3), st.randoms(use_true_random=False))
def test_engines_agree(document: Document, chance) -> None:
    arrangement = build_arrangement(document)
    query = parse_query(chance.choice(state_formulas(arrangement)), "<test>")
    explicit = ask(arrangement, query, Options(Limits(max_states=400)), engine="explicit")
    if explicit.word == "unknown":
        reject()
    bounded = ask(arrangement, query, Options(own=(UnrolledOptions(depth=DEPTH),)), "bmc")
    if explicit.word == "unreachable":
        assert bounded.word == "unknown"
        assert bounded.trace is None
        return
    assert explicit.trace is not None
    length = len(explicit.trace.steps)
    if arrangement.observe == "ringlet":
        assert (bounded.trace is not None) == (length <= DEPTH)
        assert bounded.trace is None or len(bounded.trace.steps) == length
    else:
        assert bounded.trace is None or len(bounded.trace.steps) >= length


def test_who_decided_it_is_named_and_where_nobody_did_who_was_asked() -> None:
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    found = ask(lights, parse_query("ns@GREEN", "<test>"), Options(), "explicit")
    assert (found.word, found.engine) == ("reached", "explicit")
    asked = replace(found, result=replace(found.result, engine="auto"))
    assert asked.engine == "explicit"
    (only,) = asked.result.properties
    unknown = replace(only, verdict=Verdict.UNKNOWN, trace=None, reason="the limit of 3 was reached")
    assert replace(asked, result=replace(asked.result, properties=(unknown,))).engine == "auto"
