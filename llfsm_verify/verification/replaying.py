"""Does a saved failure still happen? The executor runs the saved choices again and the property is evaluated anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from llfsm_verify.analysis.explanation.explain import explain
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.claims import Claim, claim_of
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, lost_at
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.replay.confirm import Letter, Misfit, ReplayedRun, Schedule, first_letter, perform, unfair_to
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.logic.formula import conjunction
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.program import Fairness, Int


@dataclass(frozen=True, slots=True)
class Replay:
    """`fails`: the failure still happens; `passes`: the run is possible and does not fail; `misfit`: it is not possible
    any more. `reason` says so in a sentence; `trace` is what the executor did (None when it could not begin)."""

    outcome: Literal["fails", "passes", "misfit"]
    reason: str
    trace: Trace | None
    missing: str | None = None
    """Of a misfit: the choice that a step reads and the schedule does not give, if that is all."""


MAX_COMPLETIONS = 64
"""So many runs are tried to complete a schedule."""


def replay(
    arrangement: Arrangement,
    properties: PropertySet,
    schedule: Schedule,
    fault: tuple[str, str] | None = None,
    *,
    complete: bool = False,
) -> Replay:
    """Run `schedule` again. Without `fault` (code and message), `properties` holds one goal and its assumptions.

    With `complete`, a choice that a step reads and the schedule does not give has every one of its values in turn, for
    the whole run: the answer is `passes` when no such run fails. That takes at most MAX_COMPLETIONS runs, else it is a
    misfit. Raises DiagnosticError when the property no longer fits the arrangement.
    """
    problem = bind(arrangement, properties)
    goals = goals_of(problem)
    execution = Execution(problem.program(keep_all_bits=True))
    unknown = _unknown(execution, schedule)
    if unknown is not None:
        return Replay("misfit", unknown, None)
    if not complete:
        return _run(execution, problem, goals, schedule, fault)
    return _completed(execution, problem, goals, schedule, fault)


def _completed(
    execution: Execution, problem: Problem, goals: tuple[Goal, ...], schedule: Schedule, fault: tuple[str, str] | None
) -> Replay:
    """The schedule with each constant value of what it does not give: the first run that fails, else one that does not
    fit, else one that passes."""
    choices = {c.name: c for c in execution.program.choices}
    waiting: list[dict[str, int]] = [{}]
    passed: Replay | None = None
    misfit: Replay | None = None
    tried: set[str] = set()
    number = 0
    while waiting:
        given = waiting.pop()
        number += 1
        ringlets = tuple(replace(ringlet, choices={**given, **ringlet.choices}) for ringlet in schedule.ringlets)
        done = _run(execution, problem, goals, replace(schedule, ringlets=ringlets), fault)
        if done.missing is not None:
            kind = choices[done.missing].type
            if number + len(waiting) + kind.high - kind.low + 1 > MAX_COMPLETIONS:
                return done
            waiting += [{**given, done.missing: value} for value in range(kind.high, kind.low - 1, -1)]
            tried.add(choices[done.missing].source)
        elif done.outcome == "fails":
            return done
        elif done.outcome == "misfit":
            misfit = misfit or done
        else:
            passed = passed or done
    if misfit is not None:
        return misfit
    assert passed is not None, "every run fails, fits not, or passes"
    names = ", ".join(f"`{name}`" for name in sorted(tried))
    note = f", whatever constant value {names} has, which the saved run does not give" if tried else ""
    return replace(passed, reason=f"{passed.reason}{note}")


def _run(
    execution: Execution, problem: Problem, goals: tuple[Goal, ...], schedule: Schedule, fault: tuple[str, str] | None
) -> Replay:
    try:
        first = first_letter(execution, schedule)
        # The step that faulted did not come to read the rest of what it may read now.
        replayed = perform(execution, schedule, first, open_end=fault is not None)
    except Misfit as misfit:
        return Replay("misfit", str(misfit), None, misfit.missing)
    except OverflowError:
        return Replay("misfit", "the property leaves 64-bit arithmetic in the initial configuration", None)
    if fault is not None:
        return _fault(replayed, fault)
    (goal,) = goals
    try:
        return _property(replayed, problem, goal, execution.program.fairness)
    except (AutomatonTooLarge, Unconfirmed) as limit:
        return Replay("misfit", f"whether the run violates {goal.line.name} is not known: {limit}", replayed.trace)


def _unknown(execution: Execution, schedule: Schedule) -> str | None:
    """What of the schedule the program does not know."""
    choices = {c.name: c for c in execution.program.choices}
    free = {v.name: v.type for v in execution.program.vars if v.free}
    for name, value in schedule.free:
        kind = free.get(name)
        if kind is None:
            return f"`{name}` is not free in the initial configuration any more"
        if isinstance(kind, Int) and not kind.low <= value <= kind.high:
            return f"{value} is no longer a value of `{name}`"
    for number, ringlet in enumerate(schedule.ringlets, 1):
        if ringlet.process is not None and ringlet.process >= len(execution.program.processes):
            return f"step {number} is one of a process that is not there any more"
        for name, value in ringlet.choices.items():
            choice = choices.get(name)
            if choice is not None and not choice.type.low <= value <= choice.type.high:
                return f"step {number}: {value} is no longer a value of `{name}`"
    return None


def _fault(replayed: ReplayedRun, fault: tuple[str, str]) -> Replay:
    site = replayed.trace.fault
    if site is None:
        return Replay("passes", "the run ends without a fault", replayed.trace)
    if site.code != fault[0]:
        return Replay("misfit", f"the run ends in another fault: {site.message}", replayed.trace)
    # A type or name may have changed since, so another text need not be another fault: it is said.
    before = "" if site.message == fault[1] else f" (when it was saved: {fault[1]})"
    return Replay("fails", f"the run ends in the fault: {site.message}{before}", replayed.trace)


def _property(replayed: ReplayedRun, problem: Problem, goal: Goal, fairness: Sequence[Fairness]) -> Replay:
    trace, line = replayed.trace, goal.line
    if replayed.status:
        what = trace.fault.message if trace.fault else "a value left 64 bits"
        return Replay("misfit", f"the run now ends early: {what}", trace)
    if replayed.loop_letter is None:
        if not replayed.recurs:
            return Replay("misfit", "the loop does not come back to where it started any more", trace)
        monitor = goal.monitor()
        if monitor is None:
            return Replay("misfit", f"whether the run is a bad prefix of {line.name} is not known", trace)
        lost = lost_at(monitor, goal.atoms, replayed.letters)
        if lost is None:
            return Replay("passes", f"the run is no longer a bad prefix of {line.name}", trace)
        if _break_assumptions(replayed.letters[: lost + 1], problem):
            return Replay("passes", "no run that goes on like this satisfies the assumptions", trace)
        return Replay("fails", f"the run ends in a bad prefix of {line.name}", explain(replayed, goal, problem))
    stem, loop = replayed.letters[: replayed.loop_letter], replayed.letters[replayed.loop_letter :]
    if not loop:
        return Replay("misfit", "the loop of the trace shows no letter", trace)
    unfair = unfair_to(loop, fairness)
    if unfair is not None:
        return Replay(
            "passes", f"forever the run would not be fair ({unfair}), so it is not a run of the arrangement", trace
        )
    for assumption in problem.assumptions:
        if not claim_of(assumption, problem.clock).true_on(stem, loop):
            return Replay("passes", f"the run does not satisfy the assumption {assumption.name} any more", trace)
    if goal.violated_by(stem, loop):
        return Replay("fails", f"the run violates {line.name}", explain(replayed, goal, problem))
    return Replay("passes", f"the run satisfies {line.name}", trace)


def _break_assumptions(prefix: Sequence[Letter], problem: Problem) -> bool:
    """Whether nothing that could follow satisfies all assumptions: then a bad prefix of the property does not count.

    AutomatonTooLarge: that is not known.
    """
    formulas = [line.formula for line in problem.assumptions if line.formula is not None]
    if not formulas:
        return False
    claim = Claim(conjunction(formulas), problem.clock)
    return lost_at(claim.monitor(), claim.atoms, prefix) is not None
