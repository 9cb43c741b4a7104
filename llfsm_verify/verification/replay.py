"""Does a saved failure still happen? The executor runs the saved choices again and the property is evaluated anew; of a
trace file, beside what the file expects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Protocol

from llfsm_verify.analysis.explanation.explain import explain
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.claims import Claim, claim_of
from llfsm_verify.checking.edges import with_edges_as_past
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, lost_at
from llfsm_verify.checking.goals.kinds import CHECKED, goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.replay.confirm import Letter, Misfit, ReplayedRun, Schedule, first_letter, perform, unfair_to
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.logic.formula import conjunction
from llfsm_verify.logic.properties import PropertySet, asked_text, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Fairness, Int
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import ValueProblem, choice_value
from llfsm_verify.verification.query import NAME, saved_query
from llfsm_verify.verification.tracefile import TraceFile, profile_words, read_trace_file


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
    problem = with_edges_as_past(bind(arrangement, properties))
    goals = goals_of(problem)
    execution = Execution(problem.performed())
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


@dataclass(frozen=True, slots=True)
class Replayed:
    """A trace file, the arrangement that it was run on, and what came out."""

    file: TraceFile
    arrangement: Arrangement
    replay: Replay

    @property
    def found(self) -> Literal["violated", "holds"] | None:
        """What `expect:` would have to say; None: the trace no longer fits."""
        return {"fails": "violated", "passes": "holds", "misfit": None}[self.replay.outcome]

    @property
    def asked(self) -> str | None:
        """What a saved query asked for; None: the run was not saved by a query. Reaching it is no failure."""
        goal = self.file.goal
        return None if goal is None else saved_query(goal.name, goal.kind, goal.text)

    @property
    def title(self) -> str:
        """The property with its text, what a query asked for, or the fault."""
        if self.asked is not None:
            return f"{NAME}: {self.asked}"
        if self.file.goal is not None:
            return f"{self.file.goal.name}: {asked_text(self.file.goal.kind, self.file.goal.text)}"
        assert self.file.fault is not None
        return f"{self.file.fault[0]}: {self.file.fault[1]}"

    @property
    def sentence(self) -> str:
        """Whether the failure still happens, and why we say so."""
        reason = self.replay.reason
        if self.replay.outcome == "misfit":
            return f"does not fit any more: {reason}"
        expected = "" if self.file.expect == "violated" else " (expected: holds)"
        if self.asked is not None:
            reaches = "still reaches it" if self.replay.outcome == "fails" else "does not reach it any more"
            return f"the run {reaches}{expected}"
        happens = "still happens" if self.replay.outcome == "fails" else "does not happen any more"
        return f"the failure {happens}: {reason}{expected}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What has changed since the trace was saved."""
        notes = []
        if self.arrangement.digest != self.file.digest:
            notes.append("the arrangement has changed since the trace was saved")
        if self.file.profile != profile_words(self.arrangement.profile):
            notes.append("the arrangement has another profile than when the trace was saved")
        return tuple(notes)


class Load(Protocol):
    """Loads an arrangement; `named_at` is the place in a file where its path stands."""

    def __call__(self, path: str, /, *, named_at: Span | None = None) -> Arrangement: ...


def replay_file(path: str, arrangement_path: str | None, load: Load, *, chosen: bool = False) -> Replayed:
    """Run the trace file at `path` again, on the arrangement that it names unless `arrangement_path` names another.

    `chosen`: the path is not the user's own words, so only a regular file is read there.
    With `expect: holds`, choices that the run does not give are completed. Raises
    DiagnosticError: what reading the file and loading the arrangement can raise, a trace whose arrangement did not come
    from a file (E410), a process or value that the arrangement does not have (E411).
    """
    file = read_trace_file(path, chosen=chosen)
    arrangement = _arrangement(file, arrangement_path, load)
    properties = _properties(file)
    schedule = schedule_of(file, arrangement, properties)
    done = replay(arrangement, properties, schedule, file.fault, complete=file.expect == "holds")
    return Replayed(file, arrangement, done)


def saved_run(path: str, arrangement_path: str | None, load: Load) -> tuple[TraceFile, Arrangement, Schedule]:
    """The trace file at `path`, its arrangement (the one that it names, unless another is), and the run that it has.

    Nothing is performed. DiagnosticError: as for `replay_file`.
    """
    file = read_trace_file(path)
    arrangement = _arrangement(file, arrangement_path, load)
    return file, arrangement, schedule_of(file, arrangement)


def _arrangement(file: TraceFile, arrangement_path: str | None, load: Load) -> Arrangement:
    return load(arrangement_path) if arrangement_path else load(_arrangement_path(file), named_at=file.place)


def _arrangement_path(file: TraceFile) -> str:
    if file.from_stdin:
        hint = "name it with --arrangement FILE"
        message = "the arrangement of this trace did not come from a file"
        raise DiagnosticError(Diagnostic("E410", message, hint=hint, file=file.path))
    return file.arrangement_path


def _properties(file: TraceFile) -> PropertySet:
    """The property and its assumptions as they are written in the trace file."""
    lines = {name: f"assume {name}: {text}" for name, text in file.assumptions}
    if file.goal is not None:
        kind = "" if file.goal.kind == "ltl" else f"{file.goal.kind} "
        text = file.goal.text
        if file.goal.names_a_file:
            text = f'"{Path(file.path).parent.absolute() / text}"'
        lines[file.goal.name] = f"{kind}{file.goal.name}: {text}"
    where, syntaxes = f"the property in {file.path}", dict(file.syntaxes)
    # One source each: their syntaxes may differ.
    sources = [
        Source(where, f"# syntax: {syntaxes[name]}\n{line}" if name in syntaxes else line)
        for name, line in lines.items()
    ]
    return parse_properties(sources, features=CHECKED)


def schedule_of(file: TraceFile, arrangement: Arrangement, properties: PropertySet | None = None) -> Schedule:
    """The choices as numbers; DiagnosticError (E411) for a process, or a value, that the arrangement does not have.

    `properties`: those of the file, where they are read already.
    """
    properties = _properties(file) if properties is None else properties
    program = lower(arrangement, bind(arrangement, properties).atoms)
    processes = {process.name: i for i, process in enumerate(program.processes)}
    choices = {choice.name: choice for choice in program.choices}
    moves: list[Move] = []
    for number, step in enumerate(file.steps, 1):
        if step.process is not None and step.process not in processes:
            message = f"step {number}: there is no process `{step.process}` any more"
            raise DiagnosticError(Diagnostic("E411", message, step.span))
        values: dict[str, int] = {}
        for name, text in step.choices:
            # A choice that is gone is no misfit by itself: the arrangement may have stopped reading that input.
            if name not in choices:
                continue
            try:
                values[name] = choice_value(choices[name], text)
            except ValueProblem as problem:
                raise DiagnosticError(Diagnostic("E411", f"step {number}: {name}: {problem}", step.span)) from None
        moves.append(Move(None if step.process is None else processes[step.process], values))
    return Schedule(file.free, tuple(moves), file.loop)
