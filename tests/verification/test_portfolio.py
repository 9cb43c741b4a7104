"""Several engines: who is asked, who decides, and that they must agree."""

from __future__ import annotations

import gc
import json
import time
import weakref
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement import load_arrangement, load_arrangement_text
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import FaultResult, Options, Progress, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Budget, LimitReached, Limits, tick
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.verification import differential, portfolio
from llfsm_verify.verification.differential import EnginesDisagree, compare
from llfsm_verify.verification.engines import EFFORT, FIRST, LARGE, Turn, TurnLimits
from llfsm_verify.verification.query import ask, parse_query
from llfsm_verify.verification.verify import checker, verify

NINE = portfolio.Stage("explicit", Turn(1, TurnLimits(9, 9, 100_000, None)))
LAST = portfolio.STAGES[-2]
BMC = portfolio.Stage("bmc", Turn(4, effort=EFFORT))
LIGHTS = "models/traffic_lights/arrangement.yaml"
ENDLESS = """
name: endless
whiteboard:
  stop: {type: bool, init: false, role: input}
  total: {type: int, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: total = total + 2;, transitions: [{when: stop && total > 40, to: B}]}
        - {name: B, internal: total = total + 3;}
schedule: [m]
"""
TAKEOVER = """
name: takeover
whiteboard:
  alive: {type: bool, init: true, role: input}
  beats: {type: 0..3, init: 0}
  seen: {type: 0..3, init: 0}
  missed: {type: 0..3, init: 0}
  leader: {type: bool, init: true}
machines:
  main:
    inline:
      machine: Main
      states:
        - name: RUN
          internal: "beats = alive ? (beats + 1) % 4 : beats;"
          transitions: [{when: "!leader", to: DOWN}]
        - name: DOWN
          transitions: [{when: leader, to: RUN}]
  backup:
    suspended: true
    inline:
      machine: Backup
      states:
        - name: TAKE
          on_entry: leader = false;
          transitions: [{when: alive, to: HOLD}]
        - name: HOLD
          on_entry: "leader = true;"
          internal: "suspend(self);"
  watch:
    inline:
      machine: Watch
      states:
        - name: LOOK
          internal: "missed = seen == beats ? min(missed + 1, 3) : 0; seen = beats;"
          transitions: [{when: missed == 3, to: FAIL}]
        - name: FAIL
          on_entry: "resume(backup); missed = 0;"
          transitions: [{when: leader && is_suspended(backup), to: LOOK}]
schedule: [main, backup, watch]
"""


def lines(*texts: str) -> PropertySet:
    return parse_properties([Source("test.ltl", "\n".join(texts))])


def verdicts(result: Result) -> list[str]:
    return [p.verdict.value for p in result.properties]


def without_times(result: Result) -> Result:
    attempts = tuple(replace(a, seconds=0.0) for a in result.attempts)
    return replace(result, seconds=0.0, attempts=attempts)


@pytest.fixture
def lights():
    return load_arrangement(LIGHTS)


def test_what_the_explicit_engine_decides_is_its_result(lights) -> None:
    properties = lines("a: G !(ns@GREEN && ew@GREEN)", "b: G F ns@GREEN", "c: G ns@GREEN")
    alone = verify(lights, properties, engine="explicit")
    assert without_times(verify(lights, properties, engine="auto")) == without_times(alone)
    assert alone.engine == "explicit"


@pytest.mark.slow
def test_what_enumeration_finds_at_once_waits_for_no_prover() -> None:
    """A takeover with machines that suspend each other: Spacer takes minutes, `explicit` has all at once."""
    properties = lines(
        "assume lives: G F (backup.ran && alive)",
        "one: G !(main@RUN && main.entered && backup@HOLD && !leader)",
        "back: G (watch@FAIL -> F watch@LOOK)",
        "lead: G F leader",
    )
    problem = bind(load_arrangement_text(TAKEOVER), properties)
    asked = []

    def find(name: str) -> portfolio.Check:
        asked.append(name)
        assert name == "explicit"
        return checker(name)

    result = portfolio.AutoEngine(find).check(problem, Options())
    assert asked == ["explicit"] and result.attempts == () and result.engine == "explicit"
    assert verdicts(result) == ["violated", "holds", "holds"]


@pytest.mark.long
def test_others_follow_where_its_limit_ends_it(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    """Violations too deep for the first search are found by the second; what holds is decided by the last."""
    monkeypatch.setattr(portfolio, "STAGES", (NINE, BMC, LAST))
    properties = lines("a: G !(ns@GREEN && ew@GREEN)", "b: G !ns@AMBER", "c: G !timer.ran")
    result = verify(lights, properties, engine="auto")
    assert (result.engine, result.complete, result.exploration.states) == ("auto", True, 185)
    assert verdicts(result) == ["holds", "violated", "violated"]
    assert [p.engine for p in result.properties] == ["explicit", "bmc", "explicit"]
    assert [(a.engine, a.decided) for a in result.attempts] == [
        ("explicit", ("c",)),
        ("bmc", ("b",)),
        ("explicit", ("a", "faults")),
    ]
    assert result.attempts[0].reasons == ("the limit of 9 configurations was reached",)
    assert without_times(result) == without_times(verify(lights, properties, engine="auto"))


@pytest.mark.slow
def test_steps_are_limited_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last search is without that limit, as it is without that of configurations."""
    few = portfolio.Stage("explicit", Turn(1, TurnLimits(10_000, 10_000, 9, None)))
    monkeypatch.setattr(portfolio, "STAGES", (few, LAST))
    result = verify(load_arrangement_text(ring(3, 3)), lines("a: G !(m0@ON && m1@ON && m2@ON)"), engine="auto")
    assert verdicts(result) == ["holds"]
    assert [a.reasons for a in result.attempts] == [("the limit of 9 steps was reached",), ()]


CLASSES = """
name: classes
whiteboard:
  z: {type: 0..70000, role: input}
  total: {type: KIND, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "total = z * z == 250000 ? 1 : z % 3 == 0 ? 2 : 3;"}
schedule: [m]
"""
WORK = "the limit of 10 units of work on classes of inputs was reached"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["0..3", "int"])
def test_work_on_classes_is_limited_too(kind: str) -> None:
    """Where classes are hard to find, others have their turn before all are known. The last search has no such limit,
    also where a variable has no bounds."""
    problem = bind(load_arrangement_text(CLASSES.replace("KIND", kind)), lines("a: G total < 3", "b: G total < 4"))
    most = replace(FIRST, work=10)
    few, again = (portfolio.Stage("explicit", Turn(place, most, again=place > 1)) for place in (1, 3))
    result = portfolio.AutoEngine(checker, [few, again, BMC]).check(problem, Options())
    assert verdicts(result) == ["violated", "unknown"]
    assert [(a.engine, a.decided) for a in result.attempts] == [("explicit", ()), ("bmc", ("a",))]
    assert WORK in result.attempts[0].reasons
    result = portfolio.AutoEngine(checker, [few, again, *portfolio.STAGES[-2:]]).check(problem, Options())
    assert verdicts(result) == ["violated", "holds"] and len(result.attempts) == 2


def test_the_last_searches_have_no_limit_of_work() -> None:
    """Without bounds of the variables that is the very last one, which is limited otherwise."""
    for stage in portfolio.STAGES[-2:]:
        assert stage.engine == "explicit" and stage.turn.again
        assert portfolio.limit_options(stage, Options(), endless=True).limits.max_work is None
    assert portfolio.STAGES[-1].turn.most == replace(LARGE, work=None)


@pytest.mark.slow
def test_what_no_search_reaches_is_proved(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portfolio, "STAGES", (NINE, BMC, *portfolio.STAGES[4:-1]))
    result = verify(lights, lines("a: G !(ns@GREEN && ew@GREEN)", "b: G !ns@AMBER"), engine="auto")
    assert [(p.verdict.value, p.engine) for p in result.properties] == [("holds", "induction"), ("violated", "bmc")]
    assert result.properties[0].proofs
    assert [a.engine for a in result.attempts] == ["explicit", "bmc", "induction"]


@pytest.mark.slow
def test_a_short_attempt_at_a_proof_comes_before_the_long_search(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portfolio, "STAGES", (NINE, *portfolio.STAGES[1:]))
    result = verify(lights, lines("a: G !(ns@GREEN && ew@GREEN)", "b: G !ns@AMBER"), engine="auto")
    assert [(p.verdict.value, p.engine) for p in result.properties] == [("holds", "pdr"), ("violated", "explicit")]
    assert [a.engine for a in result.attempts] == ["explicit", "pdr", "explicit"]


@pytest.mark.long
def test_where_more_is_asked_there_is_no_short_attempt(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    stages = (NINE, portfolio.STAGES[1], LAST)
    monkeypatch.setattr(portfolio, "STAGES", stages)
    properties = lines("a: G !(ns@GREEN && ew@GREEN)")
    for options in (Options(strict=True), Options(vacuity="all"), Options(witnesses=True)):
        assert [a.engine for a in verify(lights, properties, options, "auto").attempts] == ["explicit", "explicit"]
    assumed = lines("assume x: G F car", "a: G !(ns@GREEN && ew@GREEN)")
    assert [a.engine for a in verify(lights, assumed, engine="auto").attempts] == ["explicit", "explicit"]
    monkeypatch.setattr(portfolio, "MOST_SLOTS", 2)
    assert [a.engine for a in verify(lights, properties, engine="auto").attempts] == ["explicit", "explicit"]


@pytest.mark.slow
def test_a_short_attempt_is_counted(lights) -> None:
    properties = lines("a: G !(ns@GREEN && ew@GREEN)", "b: G F ns@GREEN")
    for engine in ("pdr", "induction"):
        result = verify(lights, properties, Options(effort=1_000), engine)
        assert verdicts(result) == ["unknown", "unknown"]


@pytest.mark.slow
def test_what_is_proved_has_no_witness_and_says_so(lights) -> None:
    (found,) = verify(lights, lines("a: G !(ns@GREEN && ew@GREEN)"), Options(witnesses=True), "induction").properties
    assert found.witness is None
    assert found.notes == ("no witness is shown: induction explores no configurations",)


@pytest.mark.slow
def test_where_there_may_be_no_end_there_is_no_last_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portfolio, "STAGES", (NINE, BMC, LAST))
    endless = load_arrangement_text(ENDLESS, "endless.yaml")
    result = verify(
        endless,
        lines("grows: G total < 50", "even: G (m@A -> total % 2 == 0)"),
        Options(own=(UnrolledOptions(depth=30),)),
        "auto",
    )
    assert verdicts(result)[0] == "violated"
    assert result.properties[0].engine == "bmc"
    assert result.attempts[0].reasons == ("the limit of 9 configurations was reached",)


@pytest.mark.slow
def test_a_property_may_be_called_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portfolio, "STAGES", (NINE, BMC))
    endless = load_arrangement_text(ENDLESS, "endless.yaml")
    result = verify(endless, lines("faults: G total >= 0"), Options(own=(UnrolledOptions(depth=3),)), "auto")
    whys = [part.split(":")[0] for part in result.properties[0].reason.split("; ")]
    assert (verdicts(result), whys) == (["unknown"], ["explicit", "bmc"])


def test_limits_of_the_user_end_it_all(lights) -> None:
    result = verify(lights, lines("a: G !(ns@GREEN && ew@GREEN)"), Options(Limits(timeout=0.0)), "auto")
    assert verdicts(result) == ["unknown"]
    assert (result.engine, result.exit_code) == ("explicit", 4)


@pytest.mark.slow
def test_what_an_engine_leaves_behind_is_given_back(lights) -> None:
    left: list[weakref.ref[Holder]] = []

    class Holder:
        """Refers to itself, as searches do."""

        def __init__(self) -> None:
            self.me = self

    def fake(properties: Problem, options: Options) -> Result:
        assert all(ref() is None for ref in left)
        left.append(weakref.ref(Holder()))
        return verify(properties.arrangement, PropertySet(()), Options(Limits(max_states=2)), "explicit")

    gc.disable()
    try:
        stages = (portfolio.Stage("fake", Turn(1)), portfolio.Stage("fake", Turn(2)))
        portfolio.AutoEngine({"fake": fake}.__getitem__, stages).check(bind(lights, PropertySet(())), Options())
    finally:
        gc.enable()
    assert len(left) == 2


def test_effort_is_counted() -> None:
    endless = load_arrangement_text(ENDLESS, "endless.yaml")
    (found,) = verify(endless, lines("a: G total * total >= total"), Options(effort=1), "bmc").properties
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, "the solver finds no answer with 1 units of work")


@pytest.mark.slow
def test_all_engines_agree_in_processes_of_their_own(lights) -> None:
    properties = lines("a: G !(ns@GREEN && ew@GREEN)", "b: G !timer.ran")
    result = verify(lights, properties, Options(own=(UnrolledOptions(depth=5),)), engine="all")
    assert (result.engine, verdicts(result), result.exit_code) == ("all", ["holds", "violated"], 1)
    assert {"explicit", "bmc"} <= {a.engine for a in result.attempts if "b" in a.decided}


def test_who_waits_for_engines_is_told_which_are_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(differential, "INTERVAL", 0)
    futures: list[Future[Result | None]] = [Future() for _ in differential.EACH_ENGINE]
    futures[0].set_result(None)
    futures[1].set_running_or_notify_cancel()
    said: list[str] = []

    def told(progress: Progress) -> None:
        said.append(progress.doing)
        for future in futures[1:]:
            future.set_result(None)

    differential._wait(futures, Options(progress=told), 0.0)
    assert said == ["at work: bmc; done: explicit"]


def test_an_engine_that_ends_without_an_answer_is_an_error(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(differential, "_PROGRAM", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    with pytest.raises(RuntimeError, match=r"the engine \w+ ended without an answer \(status -9\)"):
        verify(lights, lines("a: G !timer.ran"), engine="all")


def test_engines_that_are_late_are_ended() -> None:
    futures: list[Future[Result | None]] = [Future(), Future()]
    limited = Options(Limits(timeout=5.0))

    def end() -> None:
        for future in futures:
            future.set_result(None)

    differential._wait(futures, limited, time.monotonic() - 5 - differential.LATE, end)
    assert all(future.done() for future in futures)
    differential._wait(futures, limited, time.monotonic(), lambda: pytest.fail("it is not late"))


def test_where_no_engine_says_anything_the_limit_is_said(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(differential._Worker, "run", lambda *_: None)
    result = verify(lights, lines("a: G !timer.ran"), Options(Limits(timeout=5.0)), "all")
    assert (result.engine, result.properties[0].reason) == ("all", "the time limit of 5 s was reached")


@pytest.mark.slow
def test_no_time_at_all_is_no_interrupt(lights) -> None:
    result = verify(lights, lines("a: G !timer.ran"), Options(Limits(timeout=0.0)), "all")
    assert (verdicts(result), result.exit_code) == (["unknown"], 4)
    assert result.properties[0].reason == "the time limit of 0 s was reached"


def test_a_limit_ends_lowering(lights, monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(*_: object, **__: object) -> None:
        while True:
            tick()

    monkeypatch.setattr("llfsm_verify.checking.problem.lower", endless)
    monkeypatch.setattr(Budget, "seconds", property(lambda _: 9.0))
    for engine in ("auto", "explicit", "bmc", "pdr"):
        result = verify(lights, lines("a: G !timer.ran"), Options(Limits(timeout=5.0)), engine)
        assert result.properties[0].reason == result.faults.reason == "the time limit of 5 s was reached"


def test_the_time_limit_that_is_said_is_the_users(lights) -> None:
    result = verify(lights, lines("a: G !timer.ran"), Options(Limits(timeout=1e-6)), "auto")
    assert result.properties[0].reason == "the time limit of 1e-06 s was reached"
    with pytest.raises(LimitReached, match="limit of 9 s"):
        Budget(Limits(timeout=9.0).within(2.0).within(0.0)).check()


@pytest.mark.slow
def test_a_query_does_not_go_on_for_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    few = portfolio.Stage("explicit", Turn(1, TurnLimits(3_000, 3_000, 100_000, None)))
    monkeypatch.setattr(portfolio, "STAGES", (few, *portfolio.STAGES[1:]))
    endless = load_arrangement_text(ENDLESS, "endless.yaml")
    answer = ask(endless, parse_query("m@B && total > 50", "q"), engine="auto")
    assert (answer.word, answer.result.engine) == ("reached", "explicit")
    answer = ask(endless, parse_query("total < 0", "q"), engine="induction")
    assert (answer.word, answer.result.faults.verdict) == ("unreachable", Verdict.UNKNOWN)


def test_engines_that_disagree_are_found_out(lights) -> None:
    right = verify(lights, lines("a: G !ns@AMBER", "b: G !ns@AMBER"), engine="explicit")
    compare({"one": right, "two": right})
    unsure = replace(right, properties=tuple(replace(p, verdict=Verdict.UNKNOWN) for p in right.properties))
    compare({"one": right, "two": unsure})
    wrong = replace(right, properties=(right.properties[0], replace(right.properties[1], verdict=Verdict.HOLDS)))
    with pytest.raises(EnginesDisagree, match="property b: violated by one, holds by three") as caught:
        compare({"one": right, "two": unsure, "three": wrong})
    assert list(caught.value.results) == ["one", "three"]
    faulty = replace(right, faults=FaultResult(Verdict.VIOLATED, ()))
    with pytest.raises(EnginesDisagree, match="faults: holds by one, violated by two"):
        compare({"one": right, "two": faulty})


def test_a_disagreement_has_its_exit_code_and_both_results_are_saved(
    lights, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from llfsm_verify.cli import main

    right = verify(lights, lines("a: G !ns@AMBER"), engine="explicit")
    wrong = replace(right, properties=tuple(replace(p, verdict=Verdict.HOLDS, trace=None) for p in right.properties))

    def disagree(*_: object) -> Result:
        compare({"explicit": right, "bmc": wrong})
        raise AssertionError

    monkeypatch.setattr(differential, "all_engines", disagree)
    command = ["verify", "--engine", "all", LIGHTS, "-p", "a: G !ns@AMBER", "--save-traces", str(tmp_path / "d")]
    assert main(command) == 5
    assert "two parts of the toolkit disagree: property a: violated by explicit" in capsys.readouterr().err
    assert (tmp_path / "d" / "explicit" / "a.trace.yaml").exists()
    saved = json.loads((tmp_path / "d" / "bmc" / "result.json").read_text())
    assert saved["properties"][0]["verdict"] == "holds"


def test_results_of_several_engines_are_interrupted_if_one_is() -> None:
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    problem = bind(lights, lines("a: G !(ns@GREEN && ew@GREEN)"))
    one = verify(lights, lines("a: G !(ns@GREEN && ew@GREEN)"), Options(Limits(max_states=3)), "explicit")
    fewer = replace(one.exploration, states=one.exploration.states - 1)
    for first, second in ((False, False), (True, False), (False, True), (True, True)):
        merging = portfolio.Merging(problem)
        merging.add("explicit", replace(one, interrupted=first))
        merging.add("bmc", replace(one, interrupted=second, exploration=fewer))
        merged = merging.result("auto", 1.0)
        assert merged.interrupted == (first or second)
        assert (merged.engine, merged.exploration.states, merged.seconds) == ("auto", one.exploration.states, 1.0)
        assert [attempt.engine for attempt in merged.attempts] == ["explicit", "bmc"]
        assert merged.properties[0].reason == f"explicit: {one.properties[0].reason}; bmc: {one.properties[0].reason}"
