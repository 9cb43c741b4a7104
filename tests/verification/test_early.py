"""Verdicts that are told while a check goes on."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future

import pytest

from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.checking.engine import Answer, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import FAULTS, EarlyVerdict, Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit.engine import ExplicitSession
from llfsm_verify.limits import LimitReached, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification import differential, harness
from llfsm_verify.verification.verify import verify
from tests.cli.running import COUNTER, FAULTY, LIGHTS

COUNTERS = """
name: counters
cycle_ms: 100
whiteboard: {go: {type: bool, role: input}, n: {type: 0..9000}, off: {type: bool}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "if (go) n = min(n + 1, 9000);", stays: true}
schedule: [m]
"""
PROPERTIES = "low: G n < 3\nkept: G !off\nhigh: G n <= 9000\nup: G F go"


def told_by(
    engine: str, text: str, properties: str, **options: object
) -> tuple[list[EarlyVerdict], dict[str, Verdict]]:
    told: list[EarlyVerdict] = []
    arrangement = load_arrangement_text(text, "test.yaml") if "\n" in text else load_arrangement(text)
    lines = parse_properties([Source("test.ltl", properties)])
    result = verify(arrangement, lines, Options(decided=told.append, **options), engine)  # type: ignore[arg-type]
    return told, {p.name: p.verdict for p in result.properties} | {FAULTS: result.faults.verdict}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "bmc", "induction", "pdr"])
def test_what_is_told_is_known_also_when_the_search_ends_there(engine):
    """Ctrl-C right after the first verdict: the engine told it in the middle of its work, and it stays."""
    told: list[EarlyVerdict] = []

    def stop(early: EarlyVerdict) -> None:
        told.append(early)
        if len(told) == 1:
            raise KeyboardInterrupt

    lines = parse_properties([Source("test.ltl", PROPERTIES)])
    result = verify(load_arrangement_text(COUNTERS, "test.yaml"), lines, Options(decided=stop), engine)
    final = {p.name: p.verdict for p in result.properties} | {FAULTS: result.faults.verdict}
    assert result.interrupted and Verdict.UNKNOWN in final.values()
    assert final[told[0].name] is told[0].verdict


@pytest.mark.slow
@pytest.mark.parametrize("error", [MemoryError, LimitReached, Unconfirmed])
@pytest.mark.parametrize("engine", ["explicit", "pdr", "auto"])
def test_what_a_function_of_the_caller_raises_reaches_the_caller(engine: str, error: type[Exception]) -> None:
    """No engine takes it for the end of its own memory, or of a limit."""

    def fail(_: object) -> None:
        raise error("of the caller")

    lines = parse_properties([Source("test.ltl", PROPERTIES)])
    with pytest.raises(error, match=r"^of the caller$"):
        verify(load_arrangement_text(COUNTERS, "test.yaml"), lines, Options(decided=fail), engine)


class Forgetful(ExplicitSession):
    """Says at its end nothing of what it has found."""

    over = False

    def ended(self, why: str | None) -> None:
        self.over = True

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield from [Unknown("it forgot")] if self.over else super().answers(goal)

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        yield from () if self.over else super().fault_runs()


def test_a_run_that_was_confirmed_once_is_shown():
    """Such as where a limit comes before it is confirmed again: what was told stays."""
    told: list[EarlyVerdict] = []
    problem = bind(load_arrangement_text(COUNTER, "counter.yaml"), parse_properties([Source("p.ltl", "p: G n < 2")]))
    result = harness.check("forgetful", Forgetful, problem, Options(decided=told.append))
    assert {early.name for early in told} == {"p", FAULTS}
    assert result.properties[0].trace is not None and result.faults.findings[0].trace.fault is not None
    quiet = harness.check("forgetful", Forgetful, problem, Options())
    assert (quiet.properties[0].reason, quiet.faults.verdict) == ("it forgot", Verdict.UNKNOWN)


@pytest.mark.slow
def test_each_verdict_is_told_once_and_with_its_engine():
    """Explicit search leaves something to the others, which are asked again for the faults that it has decided."""
    told, final = told_by("auto", COUNTERS, PROPERTIES, limits=Limits(max_states=4_000))
    assert {early.name: early.verdict for early in told} == {n: v for n, v in final.items() if v is not Verdict.UNKNOWN}
    assert len({early.name for early in told}) == len(told)
    first, *_, last = told
    assert (first.name, first.verdict, first.engine) == ("low", Verdict.VIOLATED, "explicit")
    assert last.engine != "explicit"


def test_of_all_engines_each_tells_when_it_ends():
    """Though the others are still to agree: the engine is named."""
    lines = parse_properties([Source("test.ltl", "both: G !(ns@GREEN && ew@GREEN)\nred: G (ns@AMBER -> !ns@RED)")])
    answers = Future[Result | None](), Future[Result | None]()
    answers[0].set_result(verify(load_arrangement(FAULTY), lines, Options(), "explicit"))
    answers[1].set_exception(RuntimeError("the engine bmc failed"))
    told: list[EarlyVerdict] = []
    differential._wait(answers[:1], Options(decided=told.append), 0)
    assert {(early.name, early.verdict.value, early.engine) for early in told} == {
        ("both", "violated", "explicit"), ("red", "holds", "explicit"), (FAULTS, "holds", "explicit"),
    }  # fmt: skip
    differential._wait(answers, Options(decided=told.append), 0)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["induction", "pdr", "auto", "all"])
def test_a_proof_waits_for_a_run_that_satisfies_the_assumptions(engine: str) -> None:
    """A prover does not look for one, and another engine, or the end of the check, finds that there is none."""
    lines = "assume x: G n == 5\na: G !off\nb: G n < 9"
    limits = Limits(max_states=2 if engine == "auto" else None)
    told, final = told_by(engine, COUNTERS, lines, limits=limits)
    assert final["a"] is Verdict.UNKNOWN and {early.name for early in told} <= {FAULTS}


@pytest.mark.parametrize("accepted", [False, True])
def test_a_formula_about_the_beginning_is_no_early_pass_under_strict(*, accepted: bool) -> None:
    names = frozenset({"b"} if accepted else ())
    told, final = told_by("explicit", LIGHTS, "b: !ns@AMBER", strict=True, accepted=names, vacuity="all")
    assert final["b"] is Verdict.HOLDS and ("b" in {early.name for early in told}) == accepted


def test_a_pass_waits_for_what_may_take_it_back():
    """Assumptions that no run satisfies; and how empty a pass is, under `strict`."""
    told, final = told_by("explicit", LIGHTS, "assume no: G F (ns@GREEN && ew@GREEN)\na: G !ns@AMBER\nb: G car")
    assert final["a"] is Verdict.UNKNOWN and {early.name for early in told} == {FAULTS}
    line = "v: G (ns@GREEN && ew@GREEN -> F car)"
    for strict, names in ((False, {FAULTS, "v"}), (True, {FAULTS})):
        told, final = told_by("explicit", LIGHTS, line, strict=strict, vacuity="all")
        assert final["v"] is Verdict.HOLDS and {early.name for early in told} == names
    told, _ = told_by("explicit", LIGHTS, "apart: G !(ns@GREEN && ew@GREEN)", strict=True, vacuity="all")
    assert {early.name for early in told} == {FAULTS, "apart"}
