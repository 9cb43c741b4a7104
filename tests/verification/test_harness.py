"""The harness with engines that stop anywhere: what is known is said, and nothing is lost or made up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.engine import Answer, Explored, Given, Holds, Session, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.verdict import PERHAPS_NO_RUN, Exploration, Options, Progress, Result, Verdict
from llfsm_verify.diagnostics import Disagreement, Source
from llfsm_verify.engines.explicit.engine import ExplicitSession
from llfsm_verify.limits import LimitReached, Limits, tick
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification import harness
from llfsm_verify.verification.verify import verify

METHODS = ("search", "ended", "answers", "fault_runs", "faults", "explored", "count")
LOST = {"search": ("a", "faults"), "answers": ("a",), "fault_runs": ("faults",), "faults": ("faults",)}
"""What is not known then."""
STOPS = (KeyboardInterrupt(), LimitReached("so much"), MemoryError())


class Sure(Session):
    """Says that everything holds, and stops where it is told to."""

    def __init__(self, given: Given, where: str = "", stop: BaseException | None = None) -> None:
        self._where, self._stop = where, stop
        self.closed = False

    def _may_stop(self, where: str) -> None:
        if where == self._where and self._stop is not None:
            raise self._stop

    def search(self) -> None:
        self._may_stop("search")

    def ended(self, why: str | None) -> None:
        self.why = why
        self._may_stop("ended")

    def answers(self, goal: Goal) -> Iterator[Answer]:
        self._may_stop("answers")
        yield Unknown(self.why) if self.why else Holds()

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        self._may_stop("fault_runs")
        yield from ()

    def faults(self) -> Holds | Unknown:
        self._may_stop("faults")
        return Unknown(self.why) if self.why else Holds()

    def explored(self) -> Explored | None:
        self._may_stop("explored")
        return None

    def count(self) -> None:
        self._may_stop("count")

    def exploration(self) -> Exploration:
        return Exploration()

    def close(self) -> None:
        self.closed = True


def check(
    session: type[Session],
    *told: object,
    text: str = "a: G !(ns@GREEN && ew@GREEN)",
    options: Options = Options(),  # noqa: B008 - it is frozen
) -> tuple[Result, Session]:
    made: list[Session] = []

    def start(given: Given) -> Session:
        made.append(session(given, *told))  # type: ignore[call-arg]
        return made[-1]

    problem = bind(load_arrangement("models/traffic_lights/arrangement.yaml"), parse_properties([Source("p", text)]))
    return harness.check("sure", start, problem, options), made[0]


@pytest.mark.parametrize("stop", STOPS, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("where", METHODS)
def test_an_engine_may_be_stopped_anywhere(where: str, stop: BaseException) -> None:
    result, session = check(Sure, where, stop)
    why = str(stop) or {"KeyboardInterrupt": "interrupted", "MemoryError": "the memory ran out"}[type(stop).__name__]
    assert result.interrupted == isinstance(stop, KeyboardInterrupt)
    assert isinstance(session, Sure) and session.closed
    (found,) = result.properties
    lost = {"search": ("a", "faults"), "answers": ("a",), "fault_runs": ("faults",), "faults": ("faults",)}.get(
        where, ()
    )
    assert (found.verdict is Verdict.UNKNOWN) == ("a" in lost)
    assert (result.faults.verdict is Verdict.UNKNOWN) == ("faults" in lost)
    assert found.reason == (why if "a" in lost else None)
    assert result.faults.reason == (why if "faults" in lost else None)
    assert result.complete == (not lost)


def test_an_engine_that_cannot_begin_leaves_everything_unknown() -> None:
    def start(given: Given) -> Session:
        raise LimitReached("nothing is left")

    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    result = harness.check("late", start, bind(lights, parse_properties([Source("p", "a: G car")])), Options())
    assert [p.reason for p in result.properties] == [result.faults.reason] == ["nothing is left"]
    assert (result.engine, result.exit_code, result.complete) == ("late", 4, False)


class Wrong(Sure):
    """Gives a run that leaves 64 bits, or none, before it says that all holds."""

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield Violated(Schedule((), (), None))
        yield Holds()


def test_a_run_that_violates_nothing_is_a_disagreement() -> None:
    with pytest.raises(Disagreement, match="property a"):
        check(Wrong)


def test_whoever_knows_nothing_of_assumptions_does_not_claim_that_they_can_hold() -> None:
    result, _ = check(Sure, text="assume x: G F car\na: G !(ns@GREEN && ew@GREEN)")
    assert result.properties[0].notes == (PERHAPS_NO_RUN,)
    assert check(Sure)[0].properties[0].notes == ()


class Prefix(Sure):
    """Gives a bad prefix that no run goes on from as the assumption wants."""

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield Violated(Schedule((), (), None))
        yield Holds()


def test_a_bad_prefix_alone_is_no_violation_under_assumptions() -> None:
    (found,) = check(Prefix, text="assume x: G car\na: G car")[0].properties
    why = "under assumptions only an infinite run that satisfies them is a violation"
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, f"a violation was found, but not confirmed: {why}")
    assert check(Prefix, text="a: G car")[0].properties[0].verdict is Verdict.VIOLATED


class Halting(Prefix):
    """Is stopped after a run that is not confirmed."""

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield Violated(Schedule((), (), None))
        raise KeyboardInterrupt


def test_ctrl_c_after_a_run_that_is_not_confirmed_is_not_forgotten() -> None:
    result, _ = check(Halting, text="assume x: G car\na: G car")
    assert result.interrupted and (result.properties[0].reason or "").startswith("a violation was found, but not")


class Clock:
    """What every budget takes for the time since it was made."""

    seconds = 0.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("llfsm_verify.limits.Budget.seconds", property(lambda _: made.seconds))
    return made


class Late(Sure):
    """Finds a violation of each property; its search, and each run, take some time."""

    def __init__(self, given: Given, clock: Clock, search: float, run: float, lengths: dict[str, int]) -> None:
        super().__init__(given)
        self._clock, self._search, self._run, self._lengths = clock, search, run, lengths
        self._budget = given.budget
        self.asked: list[str] = []

    def search(self) -> None:
        self._clock.seconds += self._search

    def length(self, goal: Goal | None) -> int | None:
        return None if goal is None else self._lengths.get(goal.line.name)

    def answers(self, goal: Goal) -> Iterator[Answer]:
        if goal.line.name not in self._lengths:
            yield Holds()
            return
        self.asked.append(goal.line.name)
        self._budget.check_time()
        self._clock.seconds += self._run
        yield Violated(Schedule((), (), None))


THREE = "a: G car\nb: G car\nc: G car\nd: G !(ns@GREEN && ew@GREEN)"
LENGTHS = {"a": 30, "b": 10, "c": 20}
LIMITED = Options(Limits(timeout=5.0))
IN_VAIN = "a violation was found, but not confirmed: the time limit of 5 s was reached"


def test_after_the_time_limit_short_runs_are_confirmed_as_long_as_there_is_time(clock: Clock) -> None:
    """Of runs that take 0.4 s each, two fit: the third begins, and is not performed any more."""
    result, session = check(Late, clock, 5.1, 0.4, LENGTHS, text=THREE, options=LIMITED)
    assert isinstance(session, Late)
    assert session.asked == ["b", "c", "a"]
    a, b, c, d = result.properties
    assert [b.verdict, c.verdict, d.verdict] == [Verdict.VIOLATED, Verdict.VIOLATED, Verdict.HOLDS]
    assert (a.verdict, a.reason) == (Verdict.UNKNOWN, IN_VAIN)
    assert "of what was not found out (the time limit of 5 s was reached)" == b.trace.because == c.trace.because


def test_before_the_time_limit_runs_are_confirmed_in_the_order_of_the_properties(clock: Clock) -> None:
    result, session = check(Late, clock, 4.0, 0.4, LENGTHS, text=THREE, options=LIMITED)
    assert isinstance(session, Late)
    assert session.asked == ["a", "b", "c"]
    assert [p.verdict for p in result.properties[:3]] == [Verdict.VIOLATED] * 3
    assert all(p.trace is not None and "not found out" not in p.trace.because for p in result.properties[:3])


def test_where_the_search_itself_ends_late_what_was_found_is_said(clock: Clock) -> None:
    result, _ = check(Late, clock, 9.0, 0.4, LENGTHS, text=THREE, options=LIMITED)
    assert [p.reason for p in result.properties] == [IN_VAIN, IN_VAIN, IN_VAIN, None]
    assert result.properties[3].verdict is Verdict.HOLDS
    assert clock.seconds == 9.0


def test_the_time_limit_ends_a_confirmation(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    """That what the initial configuration shows is out of sight takes as many letters as the bound is long."""
    line = "a: car || G H[1:900] car"
    assert check(Prefix, text=line, options=LIMITED)[0].properties[0].verdict is Verdict.VIOLATED

    def slow() -> None:
        clock.seconds += 0.01
        tick()

    monkeypatch.setattr("llfsm_verify.logic.lasso.tick", slow)
    (found,) = check(Prefix, text=line, options=LIMITED)[0].properties
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, IN_VAIN)
    assert 6.0 < clock.seconds < 7.0


class LateFault(Late):
    """Finds a fault; its run is given, or there is no time even for that."""

    def length(self, goal: Goal | None) -> int | None:
        return 3

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        self._clock.seconds += self._run
        if not self._lengths:
            self._budget.check_time()
        yield 0, Violated(Schedule((), (), None))


@pytest.mark.parametrize("given", [True, False], ids=["its run is given", "its run is not given"])
def test_a_fault_that_was_found_and_not_confirmed_is_unknown(clock: Clock, given: bool) -> None:
    lengths = {"none": 3} if given else {}
    result, _ = check(LateFault, clock, 5.1, 1.5, lengths, options=LIMITED)
    assert (result.faults.verdict, result.faults.reason, result.faults.findings) == (Verdict.UNKNOWN, IN_VAIN, ())
    assert result.properties[0].verdict is Verdict.HOLDS and result.exit_code == 4


def test_after_the_time_limit_passes_are_not_looked_at(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    def late(session: ExplicitSession, why: str | None) -> None:
        clock.seconds = 5.5

    monkeypatch.setattr(ExplicitSession, "ended", late)
    monkeypatch.setattr(
        "llfsm_verify.analysis.vacuity.witnesses.Witnesses._trace", lambda *_: pytest.fail("looked for")
    )
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p", "assume x: G F car\nv: G (ns@GREEN && ew@GREEN -> F car)\nw: G !ns@GREEN")])
    empty, violated = verify(lights, lines, replace(LIMITED, witnesses=True), "explicit").properties
    assert empty.notes == ("no witness is shown: the time limit of 5 s was reached",)
    assert (empty.verdict, violated.verdict) == (Verdict.HOLDS, Verdict.VIOLATED)
    assert violated.trace is not None and "not found out" not in violated.trace.because
    assert empty.vacuity.looked == "no"
    assert empty.vacuity.reason == "not checked for vacuity: the time limit of 5 s was reached"


def test_who_waits_is_told_what_is_going_on_beside_the_search() -> None:
    told: list[Progress] = []
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p", "v: G (ns@GREEN && ew@GREEN -> F car)\nw: G !ns@GREEN")])
    verify(lights, lines, Options(progress=told.append), "explicit")
    doing = list(dict.fromkeys(p.doing for p in told if p.doing))
    assert doing[0] == "lowering to step programs"
    stages = ["compiling to machine code", "explaining violations", "looking at what a pass is worth"]
    assert [name for name in doing if name in stages] == stages
    after = [p.states for p in told if p.doing == stages[-1]]
    assert after and min(after) == max(p.states for p in told) > 1


class Counting(Sure):
    """Has explored all, and is stopped while it counts."""

    def exploration(self) -> Exploration:
        return Exploration(complete=True)


def test_what_is_counted_after_the_verdicts_does_not_make_them_partial() -> None:
    assert check(Counting, "count", KeyboardInterrupt())[0].complete
    assert not check(Counting, "search", KeyboardInterrupt())[0].complete


def test_what_was_looked_at_stays_where_a_later_part_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(*_: object) -> object:
        raise KeyboardInterrupt

    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p", "v: G (ns@GREEN && ew@GREEN -> F car)\nw: G !ns@GREEN")])
    monkeypatch.setattr("llfsm_verify.analysis.enumeration.Others", ends)
    result = verify(lights, lines, Options(strict=True, vacuity="all", traces=2), "explicit")
    empty, violated = result.properties
    assert result.interrupted and empty.vacuity.looked == "all" and empty.vacuity.findings
    assert violated.verdict is Verdict.VIOLATED and violated.more == ()


def test_a_limit_of_a_later_part_leaves_what_was_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(*_: object) -> object:
        raise LimitReached("so much")

    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    lines = parse_properties([Source("p", "v: G (ns@GREEN && ew@GREEN -> F car)\nw: G !ns@GREEN")])
    monkeypatch.setattr("llfsm_verify.analysis.enumeration.Others", ends)
    empty = verify(lights, lines, Options(strict=True, vacuity="all", traces=2), "explicit").properties[0]
    assert empty.vacuity.looked == "all" and empty.vacuity.findings and empty.vacuity.reason is None
