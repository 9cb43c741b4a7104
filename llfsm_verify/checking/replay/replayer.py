"""Runs that engines give, performed by the executor and confirmed by an evaluation that shares no code with engines.

A search is free to give an input that no machine samples another value in every letter. Which values matter is found
out afterwards: those that do not are replaced by the one before, and each attempt is performed by the executor and
confirmed like the run itself. Source of the search: Zeller and Hildebrandt, Simplifying and isolating failure-inducing
input, IEEE TSE 28 (2002): delta debugging.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import cached_property

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.engine import Violated
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, shown_atoms
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import (
    Letter,
    Misfit,
    ReplayedRun,
    Schedule,
    confirm_lasso,
    end_of,
    first_letter,
    perform,
)
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.replay.overflow import overflow_text
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.stages import stage


class Replayer:
    """The executor of one arrangement, compiled when it is first asked for.

    What the executor or the evaluation does not confirm raises Disagreement.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        self._about_assumptions = sorted({key for p in problem.assumptions for key in shown_atoms(p)})

    @cached_property
    def execution(self) -> Execution:
        """With all bits kept: what is shown is what happens."""
        return Execution(self._problem.performed())

    @stage("performing runs again")
    def violation(self, goal: Goal, run: Violated, beside: Sequence[str] = ()) -> ReplayedRun:
        """What the executor does with a violation of `goal`: as a bad prefix, or under the assumptions and fairly, for
        ever. Its trace also shows the atoms `beside`.

        Unconfirmed: the executor's 64 bits or the evaluation meet a limit, or the loop does not recur soon where that
        may be.
        """
        what = f"property {goal.line.name}"
        shown = sorted({*shown_atoms(goal.line), *beside, *self._about_assumptions})
        replayed = self._performed(run, what, shown)
        try:
            if run.schedule.loop is None:
                if self._assumed:
                    raise Unconfirmed("under assumptions only an infinite run that satisfies them is a violation")
                goal.confirm_prefix(replayed, what)
                return replayed
            if not replayed.recurs and not run.recurs:
                what_varies = "variables that the property does not depend on do not recur for long"
                raise Unconfirmed(f"{what_varies}; --cone off searches with them")
            confirm_lasso(replayed, self._assumed, self.execution.program.fairness, what)
            start = replayed.loop_letter
            if not goal.violated_by(replayed.letters[:start], replayed.letters[start:]):
                raise Disagreement(f"{what}: the trace satisfies the property")
        except ExpressionTooLarge as limit:
            raise Unconfirmed(str(limit)) from None
        return replayed

    @stage("performing runs again")
    def escape(self, run: Violated) -> Trace:
        """What the executor does with a run to where the arrangement escapes its assumptions. Its trace shows the atoms
        of these. Inputs that no machine samples are kept still where the assumptions do not see it.

        Unconfirmed: the executor's 64 bits meet their limit.
        """
        read = frozenset(name for claim in self._assumed for name in claim.atoms)

        def performed(changed: Violated) -> tuple[ReplayedRun, bytes]:
            replayed = self._performed(changed, "a run that escapes the assumptions", self._about_assumptions)
            return replayed, end_of(self.execution, self._whole(changed.schedule))

        def like_it(changed: Violated) -> ReplayedRun:
            other, other_end = performed(changed)
            if other_end != end or [letter & read for letter in other.letters] != letters:
                raise Unconfirmed("it is another run for the assumptions")
            return other

        replayed, end = performed(run)
        letters = [letter & read for letter in replayed.letters]
        return replace(steady(run, replayed, self.execution.program, like_it).trace, escape=True)

    def steady(self, goal: Goal, run: Violated, replayed: ReplayedRun) -> ReplayedRun:
        """The violation with inputs that no machine samples kept still where that is enough, confirmed again."""
        return steady(run, replayed, self.execution.program, lambda changed: self.violation(goal, changed))

    @stage("performing runs again")
    def fault(self, number: int, run: Violated) -> Trace:
        """The trace of a run that ends in fault `number` of the program. Unconfirmed: the executor's 64 bits meet their
        limit."""
        site = self.execution.program.faults[number]
        replayed = self._performed(run, f"fault {site.code}", ())
        if replayed.trace.fault != site:
            raise Disagreement(f"fault {site.code} ({site.message}): the executor does not fault on its trace")
        return replayed.trace

    def perform(self, schedule: Schedule, first: Letter, what: str, shown: Sequence[str]) -> ReplayedRun:
        """What the executor does; `first` is the first letter, `what` names the finding."""
        try:
            return perform(self.execution, schedule, first, shown)
        except Misfit as misfit:
            raise Disagreement(f"{what}: the executor cannot follow the search: {misfit}") from misfit

    def _performed(self, run: Violated, what: str, shown: Sequence[str]) -> ReplayedRun:
        try:
            first = first_letter(self.execution, run.schedule)
        except OverflowError:
            raise Unconfirmed("a property leaves 64-bit arithmetic in the initial configuration") from None
        schedule = self._whole(run.schedule)
        replayed = self.perform(schedule, first, what, shown)
        for i, letter in enumerate(run.letters or (), 1):
            if i >= len(replayed.letters) or replayed.letters[i] - self._problem.shown != letter:
                raise Disagreement(f"{what}: the executor shows another letter than the search after step {i}")
        if replayed.status == OVERFLOW:  # numbers have no end for engines that calculate with mathematical integers
            raise Unconfirmed(overflow_text(self._problem.arrangement, self.execution.program, schedule))
        return replayed

    def _whole(self, schedule: Schedule) -> Schedule:
        """A schedule of an engine as one of the executor's program, which draws all values that are stored."""
        return replace(schedule, ringlets=self._problem.forgetting.whole(schedule.ringlets, schedule.loop))


MOST_STEPS = 100_000
"""Steps that are performed to find out which values matter."""
MOST_ATTEMPTS = 60

Place = tuple[int, str]
"""A step (from 0) and a choice that only its letter reads."""


def steady(
    run: Violated, replayed: ReplayedRun, program: Program, confirm: Callable[[Violated], ReplayedRun]
) -> ReplayedRun:
    """The same run with as few changes of unsampled inputs as were found to be enough; `replayed` where that is all.

    `confirm` performs a run; it raises Disagreement or Unconfirmed where that is no violation.
    """
    steps = replayed.trace.steps
    if len(steps) != len(run.schedule.ringlets) or not any(step.world for step in steps):
        return replayed
    search = _Search(run, replayed, program, confirm)
    return search.result()


class _Search:
    def __init__(
        self, run: Violated, replayed: ReplayedRun, program: Program, confirm: Callable[[Violated], ReplayedRun]
    ) -> None:
        self._run, self._replayed, self._confirm = run, replayed, confirm
        self._steps = replayed.trace.steps
        self._start = {i.name: i.init for i in program.inputs}
        self._left = min(MOST_ATTEMPTS, MOST_STEPS // max(1, len(self._steps)))

    def result(self) -> ReplayedRun:
        found = self._attempt(())
        if found is not None:
            return found
        kept = self._differing()
        best = self._replayed
        size = (len(kept) + 1) // 2
        while size and self._left > 0:
            i = 0
            while i < len(kept) and self._left > 0:
                fewer = [*kept[:i], *kept[i + size :]]
                found = self._attempt(fewer)
                if found is None:
                    i += size
                else:
                    kept, best = fewer, found
            size = 0 if size == 1 else (size + 1) // 2
        return best

    def _differing(self) -> list[Place]:
        """The places where the run has another value than it would with all of them still."""
        still = self._moves(())
        return [
            (i, s.choice)
            for i, step in enumerate(self._steps)
            for s in step.world
            if still[i].choices[s.choice] != s.value
        ]

    def _moves(self, kept: Collection[Place]) -> list[Move]:
        last = dict(self._start)
        moves: list[Move] = []
        for i, (step, move) in enumerate(zip(self._steps, self._run.schedule.ringlets, strict=True)):
            choices = dict(move.choices)
            for s in step.sampled:
                if s.input:
                    last[s.input] = s.value
            for s in step.world:
                if (i, s.choice) not in kept:
                    choices[s.choice] = last.get(s.input, s.value)
                last[s.input] = choices[s.choice]
            moves.append(Move(move.process, choices))
        return moves

    def _attempt(self, kept: Collection[Place]) -> ReplayedRun | None:
        """The run with these places as they are, and all others still; None: it is no violation then."""
        self._left -= 1
        schedule = replace(self._run.schedule, ringlets=tuple(self._moves(set(kept))))
        try:
            found = self._confirm(replace(self._run, schedule=schedule, letters=None))
        except (Disagreement, Unconfirmed, LimitReached):
            return None
        return found if len(found.trace.steps) == len(self._steps) else None
