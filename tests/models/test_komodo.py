"""The stroll of figure 1 under the monitor: what holds of any behaviour holds of it."""

from __future__ import annotations

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.verification.verify import verify


def test_the_stroll_stays_in_the_region() -> None:
    lines = parse_properties([read_source("properties/komodo_region.ltl")])
    result = verify(load_arrangement("models/komodo_region/stroll.yaml"), lines, engine="explicit")
    assert {p.verdict for p in result.properties} == {Verdict.HOLDS}
