"""k-induction and property-directed reachability against the explicit engine: no verdict that it contradicts."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification.verify import verify
from tests.checking.problems import problems
from tests.quick import each, examples, many, spread

EFFORT = 20_000_000


def compare(problem: tuple[Arrangement, PropertySet], engine: str, tally: Counter[str]) -> None:
    arrangement, lines = problem
    explicit = verify(arrangement, lines, Options(Limits(max_states=600)), engine="explicit")
    if not explicit.complete:
        tally["too large"] += 1
        return
    proved = verify(arrangement, lines, Options(effort=EFFORT, own=(UnrolledOptions(depth=12),)), engine)
    pairs = [(p.verdict, p.reason, bool(p.proofs)) for p in proved.properties]
    pairs.append((proved.faults.verdict, proved.faults.reason, bool(proved.faults.proofs)))
    theirs = [*(p.verdict for p in explicit.properties), explicit.faults.verdict]
    for (ours, reason, has_proof), other in zip(pairs, theirs, strict=True):
        tally[ours.value] += 1
        assert (reason is not None) == (ours is Verdict.UNKNOWN)
        assert has_proof == (ours is Verdict.HOLDS)
        assert ours in (other, Verdict.UNKNOWN) or other is Verdict.UNKNOWN
    for item in proved.properties:
        tally["liveness"] += any(p.shows in ("rounds", "loops") for p in item.proofs)


def run(engine: str, count: int, *kinds: str) -> Counter[str]:
    """Compare that many, and more until each kind has come."""
    tally: Counter[str] = Counter()
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(lambda problem: compare(problem, engine, tally), amount, problems(), size=8, until=each(tally, kinds))
    return tally


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["induction", "pdr"])
def test_random_arrangements(engine: str) -> None:
    run(engine, examples(8), "holds", "violated")


@pytest.mark.long
@pytest.mark.parametrize("engine", ["induction", "pdr"])
def test_many_random_arrangements(engine: str) -> None:
    tally = run(engine, many(320), "holds", "violated", "liveness")
    assert tally["unknown"] < tally["holds"] + tally["violated"], tally
