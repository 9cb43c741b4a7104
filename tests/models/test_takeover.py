"""What the pattern of the paper misses."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.verification.verify import verify


@pytest.mark.slow
def test_the_pattern_of_the_paper_misses_a_cycle_with_both_green() -> None:
    lines = parse_properties([read_source("properties/takeover.ltl")])
    found = verify(load_arrangement("models/takeover/as_in_the_paper.yaml"), lines)
    violated = {p.name: p for p in found.properties if p.verdict.value != "holds"}
    assert set(violated) == {"caught", "noticed", "brief"} and found.complete
    trace = violated["noticed"].trace
    assert trace is not None and trace.loop is not None
    # Both are green for a whole cycle: the monitor's turn is between.
    greens = [dict(step.atoms) for step in trace.steps]
    both = [all(atoms.get(f"{m}@GREEN") for m in ("ns", "ew")) for atoms in greens]
    assert any(both[i : i + 3] == [True] * 3 and trace.steps[i + 1].machine == "monitor" for i in range(len(both)))
