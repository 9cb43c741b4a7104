"""On random arrangements, with every input counted as wide: the graph with labels is the graph without."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.kripke.labels import sizes
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.semantics.lowering import lower
from tests.kripke.labels.same import compared
from tests.kripke.labels.sensors import sensors
from tests.kripke.test_random import problems
from tests.quick import each, examples, many, spread

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]

Problem = tuple[Arrangement, Problem]
ALL = problems().map(lambda p: (p[0], bind(*p)))


def run(count: int, strategy: st.SearchStrategy[Problem], kind: str) -> None:
    """Compare that many, and more until one of that kind has come."""
    tally: Counter[str] = Counter()
    phases = [Phase.generate, Phase.shrink]
    amount = settings(max_examples=count, deadline=None, suppress_health_check=CHECKS, phases=phases)

    def checked(problem: Problem) -> None:
        arrangement, bound = problem
        program = lower(arrangement, bound.atoms)
        labels = labels_of(program, Budget(Limits()))
        if labels is None:
            tally["no inputs"] += 1
            return
        for note in labels.notes:
            tally["split" if note.classes is not None else f"enumerated: {note.reason}"] += 1
        compared(program, labels, tally)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sizes, "WIDE", 1)
        spread(checked, amount, strategy, size=10, until=each(tally, [kind]))


@pytest.mark.slow
def test_same_graph() -> None:
    run(examples(10), sensors(), "fewer steps")


@pytest.mark.long
def test_same_graph_of_many() -> None:
    run(many(120), sensors(), "fewer steps")


@pytest.mark.long
def test_same_graph_of_all_kinds() -> None:
    run(many(300), ALL, "split")
