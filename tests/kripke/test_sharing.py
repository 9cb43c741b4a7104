"""Threads of a search when something goes wrong: it ends as with one thread, or says what happened, and never waits."""

from __future__ import annotations

from threading import Thread, main_thread
from threading import current_thread as current

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.kripke import sharing
from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.kernels.shared_blocks import MOST_STEPS, NODES_EACH
from llfsm_verify.kripke.memory import OutOfMemory, Region, VectorSet
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.semantics.lowering import lower
from tests.kripke.threads import Knobs, contents, divided

WIDE = """
name: wide
whiteboard:
  i: {type: "0..199", init: 0, role: input}
  w: {type: "0..4294967295", init: 0, role: input}
  a: {type: "0..200", init: 0}
  b: {type: "0..200", init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "a = i + 1;", transitions: [{when: a > 0 && a != 41, to: B}, {when: a == 41, to: C}]}
        - {name: B, internal: "b = i;", transitions: [{when: b == 190, to: A}]}
        - {name: C, internal: "if (w == 12345678) b = 1; else b = 2;"}
schedule: [m]
"""
"""Some configuration has 2^32 steps, and many are known when it is expanded."""


def explored(text: str, jobs: int) -> tuple[Explorer, dict[str, object]]:
    explorer = Explorer(lower(load_arrangement_text(text), ()), Budget(Limits()), jobs=jobs)
    try:
        explorer.explore(None)
        return explorer, contents(explorer)
    finally:
        explorer.close()


@pytest.mark.slow
@pytest.mark.parametrize("smallest", [300, 2000])
def test_one_configuration_with_too_many_steps(smallest: int) -> None:
    """Threads begin in the middle of the batch to which it belongs, which one thread would never get to the end of."""
    with divided(Knobs(smallest=smallest)):
        alone, two = (explored(WIDE, jobs) for jobs in (1, 2))
    assert two[1] == alone[1]
    assert alone[0].graph.stopped is not None
    assert "more than 16,777,216 steps" in alone[0].graph.stopped


def test_steps_are_limited_in_the_batch_before_threads_begin() -> None:
    def stopped(jobs: int) -> dict[str, object]:
        program = lower(load_arrangement_text(WIDE), ())
        explorer = Explorer(program, Budget(Limits(max_steps=300_000)), jobs=jobs)
        try:
            explorer.explore(None)
            return contents(explorer)
        finally:
            explorer.close()

    with divided(Knobs(smallest=300)):
        assert stopped(2) == stopped(1)


def test_what_a_thread_raises_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Kernels.run

    def fail(self: Kernels, name: str, block: int) -> int:
        if current() is not main_thread():
            raise MemoryError("in a thread")
        return run(self, name, block)

    monkeypatch.setattr(Kernels, "run", fail)
    with divided(Knobs()), pytest.raises(MemoryError, match="in a thread"):
        explored(ring(4, 3), 3)


def refuse(*_: object) -> None:
    raise RuntimeError("can't start new thread")


class Refused(Region):
    def __init__(self, size: int) -> None:
        raise OutOfMemory("no more memory")


@pytest.mark.parametrize("what", ["threads", "memory"])
def test_where_there_are_no_threads_one_is_enough(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    alone = explored(ring(4, 3), 1)[1]
    if what == "threads":
        monkeypatch.setattr(Thread, "start", refuse)
    else:
        monkeypatch.setattr(sharing, "Region", Refused)
    with divided(Knobs()):
        assert explored(ring(4, 3), 3)[1] == alone


EACH_WIDE = """
name: each-wide
whiteboard:
  i: {type: "0..1999", init: 0, role: input}
  a: {type: "0..1999", init: 0}
  b: {type: "0..1", init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "a = i; b = 1;", transitions: [{when: b == 1, to: B}]}
        - {name: B, internal: "if (i == 77) b = 0; else b = 1;", transitions: [{when: a == 3000, to: A}]}
schedule: [m]
"""
"""Each of 2,000 configurations has 2,000 steps, and few successors."""


@pytest.mark.slow
def test_signals_and_limits_do_not_wait_for_a_chunk_of_many_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A task has about 2^16 steps at most; what has more is for one thread, which returns soon."""
    kept, keep = list[float](), sharing.Sharing._keep

    def note(self: sharing.Sharing, size: int, nodes: VectorSet, steps: int) -> None:
        kept.append(steps / (size // NODES_EACH))
        keep(self, size, nodes, steps)

    monkeypatch.setattr(sharing.Sharing, "_keep", note)
    alone = explored(EACH_WIDE, 1)[1]
    with divided(Knobs()):
        assert explored(EACH_WIDE, 2)[1] == alone
    assert all(steps < 2 * MOST_STEPS for steps in kept)
