"""Traces run again as schedules, and random problems, for tests of what is shown beside verdicts."""

from __future__ import annotations

from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from llfsm_verify.verification.replay import Replay, replay

Problem = tuple[Arrangement, PropertySet]


@st.composite
def problems(draw: st.DrawFn, shape: str = "{}") -> Problem:
    """An arrangement and one property called `p`, sometimes with an assumption; `shape` has a place for its text."""
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    lines = [f"p: {shape.format(draw(properties(arrangement)))}"]
    if draw(st.integers(0, 3)) == 0:
        lines.append(f"assume a: {draw(properties(arrangement))}")
    return arrangement, lines_of("\n".join(lines))


def lines_of(text: str) -> PropertySet:
    return parse_properties([Source("test.ltl", text)])


def again(arrangement: Arrangement, lines: PropertySet, trace: Trace) -> Replay:
    """What `llfsm replay` finds when a trace is run again."""
    program = lower(arrangement, bind(arrangement, lines).atoms)
    processes = {process.name: i for i, process in enumerate(program.processes)}
    moves = tuple(
        Move(None if s.process is None else processes[s.process], {x.choice: x.value for x in s.choices})
        for s in trace.steps
    )
    return replay(arrangement, lines, Schedule(trace.initial_free, moves, trace.loop))
