"""Engines that are wrong on purpose, each in one thing: the explicit engine, changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

from llfsm_verify.checking.engine import Answer, Given, Holds, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.goals.kinds import FormulaGoal, goals_of
from llfsm_verify.checking.problem import Programs
from llfsm_verify.checking.verdict import Exploration
from llfsm_verify.engines.explicit.engine import ExplicitSession
from llfsm_verify.limits import Limits, endless_budget
from llfsm_verify.logic import formula as f
from llfsm_verify.logic.formula import Formula
from llfsm_verify.testing.conformance import Delegate


class Explicit(Delegate):
    """The explicit engine, as it is."""

    def __init__(self, given: Given) -> None:
        super().__init__(ExplicitSession(given))


class Retold(Explicit):
    """Tells its violations in another way."""

    def retold(self, run: Violated) -> Violated:
        raise NotImplementedError

    def answers(self, goal: Goal) -> Iterator[Answer]:
        for answer in super().answers(goal):
            yield self.retold(answer) if isinstance(answer, Violated) else answer


# -------------------------------------------------- answers that are not computed


class AlwaysUnknown(Explicit):
    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield Unknown("who knows")


class AlwaysHolds(Explicit):
    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield Holds()


class HoldsAtLimit(Explicit):
    """What was not computed to the end holds."""

    def answers(self, goal: Goal) -> Iterator[Answer]:
        for answer in super().answers(goal):
            yield Holds() if isinstance(answer, Unknown) else answer


class NeverTheSame(Explicit):
    """Claims to decide nothing, and has another excuse each time."""

    asked: ClassVar[int] = 0

    def answers(self, goal: Goal) -> Iterator[Answer]:
        NeverTheSame.asked += 1
        yield Unknown(f"it was asked {NeverTheSame.asked} times")


class Crashes(Explicit):
    def search(self) -> None:
        raise RuntimeError("an engine of others")


# -------------------------------------------------- runs that are not those found


class DropsTheLastStep(Retold):
    def retold(self, run: Violated) -> Violated:
        schedule = run.schedule
        return replace(run, schedule=replace(schedule, ringlets=schedule.ringlets[:-1]), letters=None)


class GivesNoChoices(Retold):
    """Its traces cannot be performed."""

    def retold(self, run: Violated) -> Violated:
        moves = tuple(replace(move, choices={}) for move in run.schedule.ringlets)
        return replace(run, schedule=replace(run.schedule, ringlets=moves))


class LoopsBackToTheStart(Retold):
    def retold(self, run: Violated) -> Violated:
        loop = None if run.schedule.loop is None else 0
        return replace(run, schedule=replace(run.schedule, loop=loop))


class ShowsWrongLetters(Retold):
    def retold(self, run: Violated) -> Violated:
        return replace(run, letters=tuple(frozenset({"m@B"}) - letter for letter in run.letters or ()))


class ForgetsFreeValues(Retold):
    def retold(self, run: Violated) -> Violated:
        return replace(run, schedule=replace(run.schedule, free=()))


class StopsAtTheEnd(Explicit):
    """Runs that have ended violate nothing."""

    def answers(self, goal: Goal) -> Iterator[Answer]:
        for answer in super().answers(goal):
            ended = isinstance(answer, Violated) and any(m.process is None for m in answer.schedule.ringlets)
            yield Holds() if ended else answer


# -------------------------------------------------- another problem than the one given


class IgnoresAssumptions(Explicit):
    def __init__(self, given: Given) -> None:
        super().__init__(replace(given, problem=replace(given.problem, assumptions=())))


class ChangesFairness(Retold):
    fairness = ""

    def __init__(self, given: Given) -> None:
        super().__init__(_with(given, fairness=self.fairness))

    def retold(self, run: Violated) -> Violated:
        return replace(run, letters=None)


class IgnoresFairness(ChangesFairness):
    fairness = "none"


class AssumesFairness(ChangesFairness):
    fairness = "processes"


class ObservesRinglets(Explicit):
    def __init__(self, given: Given) -> None:
        super().__init__(_with(given, observe="ringlet"))


class SeesInitialInputs(Explicit):
    """Inputs never change."""

    def __init__(self, given: Given) -> None:
        whiteboard = tuple(replace(w, changes="never") for w in given.problem.arrangement.whiteboard)
        super().__init__(_with(given, whiteboard=whiteboard))


class TellsTimeWrongly(Explicit):
    """A cycle takes twice as long."""

    def __init__(self, given: Given) -> None:
        super().__init__(_with(given, cycle_ms=2 * (given.problem.arrangement.cycle_ms or 1)))


class OtherGoals(Explicit):
    """Looks at other goals than it is asked for."""

    def __init__(self, given: Given) -> None:
        self._goals = list(given.goals)
        self._others = [self.other(goal, given) for goal in given.goals]
        super().__init__(replace(given, goals=self._others))

    def other(self, goal: Goal, given: Given) -> Goal:
        raise NotImplementedError

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield from super().answers(next(o for g, o in zip(self._goals, self._others, strict=True) if g is goal))


class KnowsOnlySafety(OtherGoals):
    """What has no bad prefix holds."""

    def other(self, goal: Goal, given: Given) -> Goal:
        return _Safe(goal)


class _Safe:
    """A goal that is safe, it says."""

    def __init__(self, goal: Goal) -> None:
        self._goal = goal

    def __getattr__(self, name: str) -> object:
        return getattr(self._goal, name)

    def is_safe(self) -> bool:
        return True


class IgnoresBounds(OtherGoals):
    """`F[<=2s]` means `F`."""

    def other(self, goal: Goal, given: Given) -> Goal:
        if goal.line.formula is None:
            return goal
        return FormulaGoal(replace(goal.line, formula=_unbounded(goal.line.formula)), given.problem.clock)


class ForbidsInitially(OtherGoals):
    """Looks at the beginning of a run only."""

    def other(self, goal: Goal, given: Given) -> Goal:
        if goal.line.kind != "forbid":
            return goal
        line = replace(goal.line, kind="forbid initially")
        (other,) = goals_of(replace(given.problem, properties=(line,)))
        return other


# -------------------------------------------------- faults


class SeesNoFaults(Explicit):
    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        return iter(())

    def faults(self) -> Holds | Unknown:
        return Holds()


class NumbersFaultsWrongly(Explicit):
    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        found = list(super().fault_runs())
        numbers = [number for number, _ in found]
        for number, (_, run) in zip(numbers[1:] + numbers[:1], found, strict=True):
            yield number, run


class LeavesFaultsOpen(Explicit):
    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        return iter(())

    def faults(self) -> Holds | Unknown:
        return Unknown("it does not look at faults")


# -------------------------------------------------- assumptions, limits, Ctrl-C


class SaysRunsArePossible(Explicit):
    def possible(self) -> bool | None:
        return True


class SaysNoRunIsPossible(Explicit):
    def possible(self) -> bool | None:
        return False


class SwallowsCtrlC(Explicit):
    def search(self) -> None:
        try:
            super().search()
        except KeyboardInterrupt:
            pass


class IsInterruptedLater(Explicit):
    """Raises what it was stopped by when it is asked what it has explored."""

    stop: KeyboardInterrupt | None = None

    def search(self) -> None:
        try:
            super().search()
        except KeyboardInterrupt as stop:
            self.stop = stop

    def exploration(self) -> Exploration:
        if self.stop is not None:
            raise self.stop
        return super().exploration()


class Exits(Explicit):
    def search(self) -> None:
        raise SystemExit("enough")


class ClaimsAllWhenInterrupted(HoldsAtLimit):
    """Only after Ctrl-C."""

    interrupted = False

    def search(self) -> None:
        try:
            super().search()
        except KeyboardInterrupt:
            self.interrupted = True
            raise

    def answers(self, goal: Goal) -> Iterator[Answer]:
        yield from super().answers(goal) if self.interrupted else self.inner.answers(goal)


class IgnoresLimits(Explicit):
    def __init__(self, given: Given) -> None:
        super().__init__(replace(given, options=replace(given.options, limits=Limits()), budget=endless_budget()))


class GoesOnAfterTheLimit(Explicit):
    def __init__(self, given: Given) -> None:
        super().__init__(given)
        self._limited = given.options.limits.timeout is not None

    def search(self) -> None:
        super().search()
        while self._limited:
            pass


def _with(given: Given, **changes: object) -> Given:
    """With another arrangement, lowered anew."""
    arrangement = replace(given.problem.arrangement, **changes)  # type: ignore[arg-type]
    return replace(given, problem=replace(given.problem, arrangement=arrangement, programs=Programs()))


def _unbounded(formula: Formula) -> Formula:
    done: dict[Formula, Formula] = {}
    for node in f.postorder(formula):
        args = [done[a] for a in node.args]
        if node.op == "F<=":
            done[node] = f.apply("F", *args)
        else:
            done[node] = f.apply(node.op, *args, bound=node.key) if args else node
    return done[formula]
