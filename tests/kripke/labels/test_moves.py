"""Every step of a graph with labels, translated, is a step of the original program that leads to the same place."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import settings

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.problem import Problem
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.labels import sizes
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.semantics.lowering import lower
from tests.kripke.labels.sensors import NARROW, WIDE, Width, sensors
from tests.kripke.labels.test_labels import CHECKS
from tests.quick import AtLeast, examples, many, spread

NODES, EDGES = 25, 60


def followed(count: int, width: Width, steps: int) -> None:
    """Follow the moves of that many, and of more until there were so many steps."""
    tally: Counter[str] = Counter()
    amount = settings(max_examples=count, deadline=None, suppress_health_check=CHECKS)

    def checked(problem: tuple[Arrangement, Problem]) -> None:
        arrangement, bound = problem
        program = lower(arrangement, bound.atoms)
        labels = labels_of(program, Budget(Limits()))
        if labels is None or program.observe == "cycle":
            return
        explorer = Explorer(program, Budget(Limits(max_states=NODES)), labels=labels)
        original, split = NativeProgram(program), NativeProgram(labels.program)
        shown, seen = Observer(labels.program, split.layout), Observer(program, original.layout)
        outputs = split.layout.encode_outputs(split.layout.initial_outputs())
        fresh = original.layout.encode_outputs(original.layout.initial_outputs())
        size = split.layout.configuration_bytes
        try:
            explorer.explore(NODES, 100_000)
            for node in range(min(NODES, len(explorer.graph))):
                before = explorer.graph.key(node)
                for number, edge in enumerate(split.edges(before + outputs, 1)):
                    if number == EDGES:
                        break
                    move = labels.move(before + outputs, edge)
                    taken = original.step(before + fresh, move.process, move.choices)
                    assert {program.choices[i].name for i, _ in taken.samples} <= set(move.choices)
                    assert taken.status == edge.status
                    tally["faults" if edge.status > 0 else "steps"] += 1
                    if not edge.status:
                        assert taken.record[:size] == edge.record[:size]
                        assert seen.letter(taken.record) == shown.letter(edge.record)
        finally:
            explorer.close()

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sizes, "WIDE", 2)
        spread(checked, amount, sensors(width), size=4, until=AtLeast(tally, {"steps": steps}))


@pytest.mark.slow
def test_moves() -> None:
    followed(examples(4), NARROW, 30)


@pytest.mark.long
@pytest.mark.parametrize("width", [NARROW, WIDE], ids=["narrow", "wide"])
def test_moves_of_many(width: Width) -> None:
    followed(many(60), width, 60)
