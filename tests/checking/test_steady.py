"""Inputs that no machine samples: apart in traces, and still where the violation allows it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay import replayer as steady
from llfsm_verify.checking.replay.confirm import Schedule, first_letter, perform
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.replay.replayer import _Search
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, PropertyResult, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.report.tracetable import rows
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import Problem, problems
from tests.quick import examples

STAY = [{"when": "false", "to": "S"}]


def document(**more: object) -> dict[str, object]:
    """`one` copies `b`, `two` never reads it; `c` is read by nobody."""
    board = {"b": {"type": "bool", "role": "input"}, "c": {"type": "bool", "role": "input"}, "lit": {"type": "bool"}}
    one = {"machine": "One", "states": [{"name": "S", "internal": "lit = b;", "transitions": STAY}]}
    two = {"machine": "Two", "states": [{"name": "S", "transitions": [{"when": "lit", "to": "S"}]}]}
    machines = {"one": {"inline": one}, "two": {"inline": two}}
    return {"whiteboard": board, "machines": machines, "schedule": ["one", "two"], **more}


def violated(text: str, engine: str = "explicit", **more: object) -> PropertyResult:
    result = verify(build_arrangement(document(**more)), parse_properties([Source("p", text)]), Options(), engine)
    (found,) = [p for p in result.properties if p.verdict is Verdict.VIOLATED]
    return found


def shown(trace: Trace) -> list[tuple[dict[str, str], dict[str, str]]]:
    return [({s.input: s.text for s in t.sampled}, {s.input: s.text for s in t.world}) for t in trace.steps]


def test_what_nobody_samples_stands_apart() -> None:
    found = violated("p: G (b && !Y b && two.ran -> lit)")
    assert found.trace is not None
    assert shown(found.trace) == [({"b": "false"}, {}), ({}, {"b": "true"})]
    assert [row.inputs for row in rows(found.trace)] == ["", "", "(b = true)"]
    assert found.notes == (
        "no machine sampled `b` at step 2, it was in the surroundings only; `sampled(b)` is what machines saw last",
    )


@pytest.mark.parametrize("engine", ["explicit", "bmc"])
def test_only_what_the_violation_needs_changes(engine: str) -> None:
    found = violated("p: G !(c && X (!c && X X c))", engine)
    assert found.trace is not None
    values = [world["c"] for _, world in shown(found.trace)]
    changes = sum(a != b for a, b in zip(["false", *values], values, strict=False))
    assert changes == 3
    still = violated("q: G (c || !lit)", engine)
    assert still.trace is not None
    assert {world["c"] for _, world in shown(still.trace)} == {"false"}
    assert all("c" not in row.inputs for row in rows(still.trace) if row.step != "1")


def test_a_violation_stays_where_keeping_inputs_still_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("llfsm_verify.checking.replay.replayer.steady", interrupted)
    lines = parse_properties([Source("p", "p: G !c")])
    result = verify(build_arrangement(document()), lines, Options(), "explicit")
    assert result.interrupted
    assert result.properties[0].verdict is Verdict.VIOLATED
    assert result.properties[0].trace is not None


def test_a_letter_a_cycle() -> None:
    found = violated("p: G (c -> lit)", observe="cycle")
    assert found.trace is not None
    assert [world for _, world in shown(found.trace)] == [{}, {"c": "true"}]


def test_stuttering_letters_show_the_surroundings_only() -> None:
    done = {"machine": "M", "states": [{"name": "A", "on_entry": "x = b;"}]}
    board = {"b": {"type": "bool", "role": "input"}, "x": {"type": "bool"}}
    ended = {"whiteboard": board, "machines": {"m": {"inline": done}}, "schedule": ["m"]}
    result = verify(build_arrangement(ended), parse_properties([Source("p", "G !(X X b)")]), Options(), "explicit")
    trace = result.properties[0].trace
    assert trace is not None
    assert shown(trace)[:2] == [({"b": "false"}, {}), ({}, {"b": "true"})]


@pytest.mark.slow
@settings(max_examples=examples(20), deadline=None)
@given(problems())
def test_a_steady_run_is_as_short_and_still_a_violation(drawn: Problem) -> None:
    """Of random problems: performed again from its own choices, the trace has the letters of a violation."""
    arrangement, lines = drawn
    problem = bind(arrangement, lines)
    result = verify(arrangement, lines, Options(limits=Limits(max_states=300)), "explicit")
    execution = Execution(problem.program(keep_all_bits=True))
    names = {p.name: i for i, p in enumerate(problem.program().processes)}
    for found in result.properties:
        if found.trace is None:
            continue
        moves = tuple(
            Move(None if s.process is None else names[s.process], {c.choice: c.value for c in s.choices})
            for s in found.trace.steps
        )
        schedule = Schedule(found.trace.initial_free, moves, found.trace.loop)
        again = perform(execution, schedule, first_letter(execution, schedule))
        assert shown(again.trace)[: len(moves)] == shown(found.trace)
        assert [s.changes for s in again.trace.steps][: len(moves)] == [s.changes for s in found.trace.steps]


def test_a_state_that_has_not_been_entered_is_pointed_out() -> None:
    states = [
        {"name": "A", "transitions": [{"when": "b", "to": "B"}]},
        {"name": "B", "on_entry": "n = 1;", "on_exit": "n = 0;", "transitions": [{"when": "!b", "to": "A"}]},
    ]
    board = {"b": {"type": "bool", "role": "input"}, "n": {"type": "0..3"}}
    arrangement = build_arrangement(
        {"whiteboard": board, "machines": {"m": {"inline": {"machine": "M", "states": states}}}, "schedule": ["m"]}
    )
    text = "p: G (m@B -> n == 1)\nq: G (m.entered(B) -> n == 1)\nr: G !m@B"
    result = verify(arrangement, parse_properties([Source("p", text)]), Options(), "explicit")
    said = {p.name: (p.verdict.value, p.notes) for p in result.properties}
    note = "`m@B` is true at step 1, and `on_entry` has not run yet; `m.entered(B)` is true when it has"
    assert said == {"p": ("violated", (note,)), "q": ("holds", ()), "r": ("violated", ())}


@pytest.mark.slow
def test_so_many_attempts_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is a run performed once more; what was found until then is kept."""
    performed: list[int] = []
    attempt = _Search._attempt

    def counted(search: _Search, kept: list[tuple[int, str]]):
        performed.append(len(kept))
        return attempt(search, kept)

    monkeypatch.setattr(_Search, "_attempt", counted)
    text = "p: G !(c && X (!c && X (c && X (!c && X c))))"
    found = violated(text)
    full = len(performed)
    assert full > 4 and performed[0] == 0 and found.trace is not None
    for most in (1, 2, 3):
        performed.clear()
        monkeypatch.setattr(steady, "MOST_ATTEMPTS", most)
        assert violated(text).trace is not None
        assert len(performed) == most
    monkeypatch.setattr(steady, "MOST_ATTEMPTS", 60)
    monkeypatch.setattr(steady, "MOST_STEPS", 2 * len(found.trace.steps))
    performed.clear()
    assert violated(text).trace is not None and len(performed) == 2
