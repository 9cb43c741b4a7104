"""Whether a fault can be reached: which one is told, how far it is looked for, and that the executor is asked."""

from __future__ import annotations

from contextlib import closing

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.reach import Reachable
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower


def program_of(action: str) -> Program:
    states = [{"name": "ON", "internal": action, "stays": True}]
    return lower(
        build_arrangement({
            "name": "counter",
            "whiteboard": {"n": {"type": "0..9", "role": "output"}, "go": {"type": "bool", "role": "input"}},
            "machines": {"count": {"inline": {"machine": "Count", "states": states}}},
            "schedule": ["count"],
        }),
        keep_all_bits=True,
    )  # fmt: skip


BOTH = program_of("n = go ? (n + 1) % 10 : 4 / (4 - n) * 0 + 2 / (2 - n) * 0;")
"""Divides by zero without `go`, where n is 4 and where it is 2."""


def at_zero(program: Program) -> list[int]:
    return [number for number, site in enumerate(program.faults) if "division" in site.message]


def test_the_nearest_fault_is_told_unless_another_is_asked_for_first():
    one, other = at_zero(BOTH)
    with closing(Reachable(BOTH, Budget(Limits()))) as space:
        found = space.fault({one, other})
        assert found is not None
        assert found.fault == other
        assert len(found.moves) == len(found.path) == 3
        assert (space.graph.unfinished, space.graph.complete) == (None, True)
    with closing(Reachable(BOTH, Budget(Limits()))) as space:
        found = space.fault({one}, {other})
        assert found is not None
        assert found == space.fault({one})
        assert len(found.moves) == 5


def test_it_can_begin_anywhere():
    layout = Layout.of(BOTH)
    start = {**layout.decode(layout.first()), "n": 2}
    with closing(Reachable(BOTH, Budget(Limits()), roots=[layout.encode(start)])) as space:
        found = space.fault(set(at_zero(BOTH)))
        assert found is not None
        assert len(found.moves) == 1


def test_what_a_limit_leaves_open_is_unfinished():
    program = program_of("n = (n + 1) % 10;")
    with closing(Reachable(program, Budget(Limits(max_states=5)))) as space:
        assert space.fault(set(at_zero(program))) is None
        assert space.graph.unfinished == "the limit of 5 configurations was reached"
    with closing(Reachable(program, Budget(Limits()))) as space:
        assert space.explore() is None


def test_the_executor_has_the_last_word(monkeypatch):
    step = Execution.step

    def fine(execution, record, move):
        return step(execution, record, move)._replace(status=0)

    monkeypatch.setattr(Execution, "step", fine)
    with closing(Reachable(BOTH, Budget(Limits()))) as space, pytest.raises(Disagreement):
        space.fault(set(at_zero(BOTH)))
