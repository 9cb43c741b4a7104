"""Different counterexamples: every one fails, no two take the same path, and none is missed."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, event, given, settings

from llfsm_verify.analysis.enumeration import NO_MORE, Signature, Tree, signature_of
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.goal import mask
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule, atoms_of, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.verdict import Options, PropertyResult, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.transforms.cone import cone
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import Problem, again, lines_of, problems
from tests.quick import many

LIMITS = Limits(max_states=400)
SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
LIGHTS = Path("models/traffic_lights")


def test_memory_that_runs_out_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_args: object) -> None:
        raise MemoryError

    monkeypatch.setattr("llfsm_verify.analysis.enumeration.signature_of", fails)
    lines = parse_properties([Source("p", "G !ns@GREEN")])
    options = Options(traces=2)
    found = verify(load_arrangement(LIGHTS / "arrangement.yaml"), lines, options, "explicit").properties[0]
    assert (found.verdict, found.more, found.only) == (Verdict.VIOLATED, (), "the memory ran out")


def machines_of(arrangement: Arrangement, lines: PropertySet) -> frozenset[str]:
    program = lower(arrangement, bind(arrangement, lines).atoms)
    left_out = cone(program).left_out
    return frozenset(m.name for m in program.machines if m.name not in left_out)


def signatures(arrangement: Arrangement, lines: PropertySet, result: PropertyResult) -> list[Signature]:
    assert result.trace is not None
    machines = machines_of(arrangement, lines)
    return [signature_of(trace, machines) for trace in (result.trace, *result.more)]


def check(problem: Problem) -> None:
    arrangement, lines = problem
    result = verify(arrangement, lines, Options(LIMITS, traces=4), engine="explicit")
    (found,) = result.properties
    assume(found.trace is not None and result.complete)
    assert found.trace is not None
    event(f"{1 + len(found.more)} counterexamples")
    seen = signatures(arrangement, lines, found)
    assert len(set(seen)) == len(seen) == 1 + len(found.more)
    for trace in (found.trace, *found.more):
        assert again(arrangement, lines, trace).outcome == "fails"
        assert trace.because is not None
    assert (found.only is None) == (len(seen) == 4)


@pytest.mark.slow
@settings(max_examples=4, deadline=None, suppress_health_check=SLOW)
@given(problems())
def test_every_counterexample_fails_and_takes_another_path(problem: Problem) -> None:
    check(problem)


@pytest.mark.long
@settings(max_examples=many(300), deadline=None, suppress_health_check=SLOW)
@given(problems())
def test_every_counterexample_fails_and_takes_another_path_at_length(problem: Problem) -> None:
    check(problem)


MOST = 3_000


def by_hand(arrangement: Arrangement, lines: PropertySet) -> set[Signature]:
    """The signatures of all bad prefixes, from every step of the executor; arrangements too large for that are out."""
    bound = bind(arrangement, lines)
    (goal,) = goals_of(bound)
    monitor = goal.monitor()
    assume(monitor is not None and arrangement.observe == "ringlet")
    assert monitor is not None
    machines = machines_of(arrangement, lines)
    execution = Execution(lower(arrangement, bound.atoms, keep_all_bits=True))
    record = execution.start()
    assume(not execution.free(record))
    first = first_letter(execution, Schedule((), (), None))
    found: set[Signature] = set()
    start = monitor.initial()
    assume(start is not None)
    assert start is not None
    begin = monitor.step(start, mask(first, goal.atoms))
    if begin is None:
        return {()}
    todo: list[tuple[bytes, int, Signature]] = [(record, begin, ())]
    seen = {(execution.configuration(record), begin, ())}
    choices = [c.name for c in execution.program.choices]
    while todo:
        record, state, signature = todo.pop()
        for edge in execution.native.successors(record):
            if edge.status:
                continue
            move = Move(None if edge.process < 0 else edge.process, {choices[c]: v for c, v in edge.samples})
            step = execution.describe(record, move, execution.step(record, move), ())
            fired = (step.machine, step.fired)
            following = signature
            if step.machine in machines and step.fired is not None and fired not in signature:
                following = (*signature, (step.machine, step.fired))
            after = monitor.step(state, mask(atoms_of(execution, edge.record), goal.atoms))
            if after is None:
                found.add(following)
                continue
            key = (execution.configuration(edge.record), after, following)
            if key not in seen:
                assume(len(seen) < MOST)
                seen.add(key)
                todo.append((edge.record, after, following))
    return found


def none_is_missed(problem: Problem) -> None:
    arrangement, lines = problem
    assume(not lines.assumptions)
    expected = by_hand(arrangement, lines)
    assume(1 <= len(expected) <= 12)
    event(f"{len(expected)} signatures")
    result = verify(arrangement, lines, Options(Limits(max_states=4_000), traces=20), engine="explicit")
    (found,) = result.properties
    assume(result.faults.verdict is Verdict.HOLDS)
    assert found.trace is not None
    assert set(signatures(arrangement, lines, found)) >= expected
    if all(trace.failed_at is not None for trace in (found.trace, *found.more)):
        assert set(signatures(arrangement, lines, found)) == expected
        assert found.only == NO_MORE


@pytest.mark.slow
@settings(max_examples=3, deadline=None, suppress_health_check=SLOW)
@given(problems("G ({})"))
def test_no_path_to_a_bad_prefix_is_missed(problem: Problem) -> None:
    none_is_missed(problem)


@pytest.mark.long
@settings(max_examples=many(250), deadline=None, suppress_health_check=SLOW)
@given(problems("G ({})"))
def test_no_path_to_a_bad_prefix_is_missed_at_length(problem: Problem) -> None:
    none_is_missed(problem)


@pytest.mark.slow
def test_the_faulty_lights_fail_on_two_paths() -> None:
    arrangement = load_arrangement(str(LIGHTS / "faulty.yaml"))
    lines = lines_of("both: G !(ns@GREEN && ew@GREEN)")
    (found,) = verify(arrangement, lines, Options(traces=5), engine="explicit").properties
    one, two = signatures(arrangement, lines, found)
    assert set(one) == set(two) and one != two
    assert found.only == NO_MORE


@pytest.mark.slow
def test_infinite_counterexamples_differ_too() -> None:
    arrangement = load_arrangement(str(LIGHTS / "arrangement.yaml"))
    lines = lines_of("served: G F ew@GREEN")
    (found,) = verify(arrangement, lines, Options(traces=30), engine="explicit").properties
    assert found.trace is not None
    assert all(
        t.loop is not None and again(arrangement, lines, t).outcome == "fails" for t in (found.trace, *found.more)
    )
    assert signatures(arrangement, lines, found) == list(dict.fromkeys(signatures(arrangement, lines, found)))
    assert found.only == NO_MORE


@pytest.mark.slow
def test_a_limit_is_said() -> None:
    arrangement = load_arrangement(str(LIGHTS / "faulty.yaml"))
    lines = lines_of("both: G !(ns@GREEN && ew@GREEN)")
    (found,) = verify(arrangement, lines, Options(Limits(max_states=172), traces=9), engine="explicit").properties
    assert found.only is not None and "172 configurations" in found.only


def test_the_tree_tells_runs_apart_by_what_fires_first() -> None:
    a, b, c = ("m", "a"), ("m", "b"), ("m", "c")
    tree = Tree([a, b, c], [(a, b), (a,)])
    at_a = tree.after(Tree.ROOT, 0b001)
    assert not tree.is_new(at_a) and tree.is_new(Tree.ROOT)
    assert tree.after(at_a, 0b001) == at_a
    at_b = tree.after(at_a, 0b010)
    assert not tree.is_new(at_b) and at_b == tree.after(Tree.ROOT, 0b011)
    assert tree.after(at_b, 0b100) == Tree.AWAY == tree.after(Tree.ROOT, 0b010)
    assert tree.is_new(Tree.AWAY) and tree.after(Tree.AWAY, 0b001) == Tree.AWAY
