"""Violations and faults in runs of growing length, for the engines that look for them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import z3

from llfsm_verify.analysis.explanation.explain import explained
from llfsm_verify.analysis.vacuity.witnesses import unwitnessed
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Arithmetic
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import Effort
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.claims import Claim, claim_of, premised, unconditional
from llfsm_verify.checking.goals.formulas import FormulaGoal
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, bad_prefixes_of
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.goals.regular import RegularGoal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.proof import Proof
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.replay.saved import first_letter
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.vacuity import Vacuity
from llfsm_verify.checking.verdict import (
    FaultFinding,
    FaultResult,
    Options,
    Progress,
    PropertyResult,
    Result,
    Verdict,
)
from llfsm_verify.engines.unrolled.encoding import Encoding
from llfsm_verify.engines.unrolled.loops import Loops
from llfsm_verify.engines.unrolled.question import Question
from llfsm_verify.engines.unrolled.runs import AutomatonRun, Watched, automaton_table, monitor_table
from llfsm_verify.engines.unrolled.schedules import schedule_of
from llfsm_verify.limits import Budget, memory_in_use
from llfsm_verify.logic.formula import is_plain
from llfsm_verify.logic.rewriting.normal_form import nnf

DEPTH = 60
"""Steps up to which runs are looked at, unless --depth says otherwise."""


class Reading(Protocol):
    """Something that reads a run beside it: a formula, or an automaton."""

    constraints: list[z3.BoolRef]

    def add(self, letter: Mapping[str, z3.BoolRef], observed: z3.BoolRef, loops: Loops) -> None: ...

    def holds(self) -> z3.BoolRef: ...

    def closed(self, loops: Loops) -> list[z3.BoolRef]: ...


class Task:
    """A property: its bad prefixes, by a monitor, and its violations for ever, by readings."""

    def __init__(self, goal: Goal, question: Question, watched: Watched | None) -> None:
        self.goal = goal
        self.question = question
        self.watched = watched
        self.bad: z3.BoolRef = z3.BoolVal(False)
        """The last point completes a bad prefix."""
        self.lost: z3.BoolRef = z3.BoolVal(False)
        """Some point does."""
        self.context: list[Reading] = []
        """What is assumed, and fairness."""
        self.wrong: Reading | None = None
        self.limit: str | None = None
        """What could not be written out, so that some violations are not looked for."""
        self.result: PropertyResult | None = None
        self.points = 0
        """Points of the run that were read."""

    @property
    def is_asked(self) -> bool:
        """Some of its violations are looked for."""
        return self.watched is not None or self.wrong is not None

    @property
    def readings(self) -> list[Reading]:
        return self.context if self.wrong is None else [*self.context, self.wrong]


class BoundedSearch:
    """Runs of growing length, asked for faults and for violations of every property; what is found is confirmed."""

    def __init__(
        self,
        problem: Problem,
        options: Options,
        engine: str,
        arithmetic: Arithmetic | None = None,
    ) -> None:
        """`engine` is what results name; `arithmetic` the theory of numbers (chosen by the program where None)."""
        self._engine = engine
        self._problem = problem
        self._options = options
        self.budget = Budget(options.limits)
        with self.budget:
            self.goals = goals_of(problem)
        self.program = problem.program(keep_all_bits=options.keep_all_bits)
        self._terms = Terms(self.program, arithmetic)
        self._finite = self._terms.arithmetic.name == "bit-vectors"
        self._run = Unrolling(self._terms)
        self._loops = Loops(self._terms)
        self._loops.add(self._run.points[0])
        self._replayer = Replayer(problem)
        self.assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        self.fair = [*premised(self.program), *unconditional(self.program)]
        self.faults: list[FaultFinding] = []
        self.effort = Effort(options.effort)
        """What is left of the work that solvers may do."""
        self._fault_question = Question(finite=self._finite, total=self.effort)

    # ------------------------------------------------------------ what is asked

    def task(self, goal: Goal) -> Task:
        """What to ask for a goal. LimitReached."""
        question = Question(finite=self._finite, total=self.effort)
        name = goal.line.name
        watched, safe, limit = None, False, None
        try:
            monitor, safe = bad_prefixes_of(goal)
            if monitor is not None:
                watched = Watched(monitor_table(monitor, goal.atoms), f"{name}.bad")
        except AutomatonTooLarge as reached:
            limit = reached
        if watched is None and isinstance(goal, FormulaGoal):
            safe = False  # without the table of its monitor a safety property is looked at as any other
        task = Task(goal, question, watched)
        if watched is None and isinstance(goal, RegularGoal):
            task.limit = str(limit)
            return task  # there is nothing to ask: only bad prefixes violate it
        try:
            if self.assumed:
                claims = [*self.assumed, *self.fair]
                task.context = [self._reading(c, f"{name}.{i}") for i, c in enumerate(claims)]
            if not safe:
                fair = [] if self.assumed else self.fair
                task.context += [self._reading(c, f"{name}.{i}") for i, c in enumerate(fair)]
                task.wrong = self._wrong(goal, f"{name}.wrong")
        except AutomatonTooLarge as reached:
            limit = reached
        # The encoding of a formula finds bad prefixes itself, those at least that show why they are bad.
        if limit is not None and not isinstance(task.wrong, Encoding):
            task.limit = str(limit)
        return task

    def _reading(self, claim: Claim, name: str) -> Reading:
        if is_plain(claim.formula):
            return Encoding(nnf(claim.formula), name)
        table = automaton_table(claim.automaton(), claim.atoms)
        return AutomatonRun(table, name)

    def _wrong(self, goal: Goal, name: str) -> Reading:
        """The runs that violate a goal."""
        if isinstance(goal, FormulaGoal) and is_plain(goal.claim.formula):
            return Encoding(nnf(goal.claim.formula, negate=True), name)
        return AutomatonRun(automaton_table(goal.violations(), goal.atoms), name)

    # ------------------------------------------------------------ looking

    def __len__(self) -> int:
        """The steps of the runs that are looked at."""
        return len(self._run)

    def extend(self) -> None:
        """Go on to runs of one step more."""
        if self._options.progress is not None:
            n = len(self._run)
            self._options.progress(Progress(0, n, n, n, self.budget.seconds, memory_in_use(), "asking the solver"))
        self.budget.check()
        self._loops.add(self._run.extend())

    def look(self, tasks: Sequence[Task]) -> None:
        """Look for violations of the present length, in tasks that have looked at all shorter ones."""
        for task in tasks:
            if task.result is None and task.points < len(self._run.points):
                self._read(task)
                self._look(task)

    def _read(self, task: Task) -> None:
        """The readings read the last point."""
        assert task.points == len(self._run.points) - 1, "a task looks at every length"
        task.points += 1
        point = self._run.points[-1]
        letter = dict.fromkeys(self._hidden, z3.BoolVal(False)) | dict(point.letter)
        if task.watched is not None:
            task.bad = task.watched.add(letter, point.observed)
            task.lost = z3.Or(task.lost, task.bad)
            task.question.learn(task.watched.constraints)
        for reading in task.readings:
            reading.add(letter, point.observed, self._loops)
            task.question.learn(reading.constraints)
        task.question.learn(self._loops.constraints)
        task.question.learn(self._run.constraints)

    @property
    def _hidden(self) -> list[str]:
        """What the first letter does not show: the outputs of fairness, which only loops ask for."""
        return [n for f in self.program.fairness for n in (f.premise, f.goal) if n is not None]

    def _look(self, task: Task) -> None:
        for question, prefix in self._questions(task):
            model = task.question.ask(question, self.budget)
            if model is not None:
                self._found(task, model, None if prefix else self._loops.start(model))
                return

    def _questions(self, task: Task) -> Iterator[tuple[list[z3.BoolRef], bool]]:
        """What would be a violation of the present length, and whether it is a bad prefix by itself."""
        if task.watched is not None:
            yield ([task.lost, *self._for_ever(task.context)], False) if self.assumed else ([task.bad], True)
        elif isinstance(task.wrong, Encoding) and not self.assumed:
            wrong = task.wrong
            yield [*wrong.closed(self._loops), wrong.holds(), z3.Not(self._loops.exists)], True
        if task.wrong is not None:
            yield self._for_ever([*task.context, task.wrong]), False

    def _for_ever(self, readings: Sequence[Reading]) -> list[z3.BoolRef]:
        """The run has a loop, on which all readings say that it satisfies what they read."""
        found = [*self._loops.closed(), self._loops.exists]
        for reading in readings:
            found += [*reading.closed(self._loops), reading.holds()]
        return found

    def look_for_faults(self) -> None:
        """Look for steps behind the present length that end in a fault."""
        here = self._run.begin()
        self._fault_question.learn(self._run.constraints)
        found = {self.program.faults.index(f.site) for f in self.faults}
        for number in range(len(self.program.faults)):
            condition = z3.simplify(here.fault(self._terms.arithmetic, number))
            if number in found or z3.is_false(condition):
                continue
            model = self._fault_question.ask([condition], self.budget)
            trace = None if model is None else self._fault(number, model)
            if trace is not None:
                self.faults.append(FaultFinding(self.program.faults[number], trace))

    # ------------------------------------------------------------ what is found

    def _found(self, task: Task, model: z3.ModelRef, start: int | None) -> None:
        goal, what = task.goal, f"property {task.goal.line.name}"
        schedule = schedule_of(self._run, model, len(self._run), start)
        first = first_letter(self._replayer.execution, schedule)
        replayed = self._replayer.perform(schedule, first, what, self._replayer.shown(goal, self.assumed))
        try:
            self._replayer.confirm(goal, self.assumed, replayed, what, prefix=start is None)
        except Unconfirmed as stop:
            reason = f"a violation was found, but not confirmed: {stop}"
            task.result = self._property(goal, Verdict.UNKNOWN, reason=reason)
            return
        task.result = self._property(goal, Verdict.VIOLATED, explained(replayed, goal, self._problem))

    def _fault(self, number: int, model: z3.ModelRef) -> Trace | None:
        """The run of a model into a fault; None: the executor's 64 bits end it before."""
        site = self.program.faults[number]
        schedule = schedule_of(self._run, model, len(self._run) + 1)
        first = first_letter(self._replayer.execution, schedule)
        replayed = self._replayer.perform(schedule, first, f"fault {site.code}", ())
        try:
            self._replayer.confirm_fault(site, replayed)
        except Unconfirmed:
            return None
        return replayed.trace

    def result(self, goal: Goal, task: Task | None, why: str | None) -> PropertyResult:
        """What was found, else that it is unknown: `why`. `task` None: it was never asked for."""
        if task is not None and task.result is not None:
            return task.result
        if task is not None and task.limit is not None:
            why = f"{task.limit}; and {why}" if task.is_asked else task.limit
        return self._property(goal, Verdict.UNKNOWN, reason=why)

    def whole(
        self,
        properties: tuple[PropertyResult, ...],
        faults: FaultResult,
        *,
        seconds: float,
        complete: bool,
        interrupted: bool,
    ) -> Result:
        """The result of an engine that counts no configurations."""
        return Result(
            arrangement=self._problem.arrangement.name,
            path=self._problem.arrangement.path,
            engine=self._engine,
            complete=complete,
            states=0,
            transitions=0,
            seconds=seconds,
            assumptions=tuple(p.name for p in self._problem.assumptions),
            properties=properties,
            faults=faults,
            interrupted=interrupted,
            depth=len(self),
            strict=self._options.strict,
            asked_vacuity=self._options.strict or self._options.vacuity == "all",
        )

    def held(self, goal: Goal, proofs: tuple[Proof, ...], notes: tuple[str, ...] = ()) -> PropertyResult:
        """That a goal holds. Whether it does so emptily shows in a graph, and there is none."""
        why = f"{self._engine} explores no configurations"
        vacuity = Vacuity(reason=f"not checked for vacuity: {why}", accepted=goal.line.name in self._options.accepted)
        result = replace(self._property(goal, Verdict.HOLDS), proofs=proofs, notes=notes, vacuity=vacuity)
        return unwitnessed(result, why) if self._options.witnesses else result

    def _property(
        self, goal: Goal, verdict: Verdict, trace: Trace | None = None, reason: str | None = None
    ) -> PropertyResult:
        line = goal.line
        assert line.kind != "assume"
        return PropertyResult(line.name, line.kind, line.text, line.span, verdict, self._engine, trace, reason)
