"""Bounded model checking: every violation of one length before the next, by a solver, confirmed by the executor."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import z3

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Arithmetic
from llfsm_verify.backends.smt.asking import Effort
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.bounded.asking import Question
from llfsm_verify.checking.bounded.encoding import Encoding
from llfsm_verify.checking.bounded.loops import Loops
from llfsm_verify.checking.bounded.runs import AutomatonRun, Watched, automaton_table, monitor_table
from llfsm_verify.checking.bounded.scripts import script_of
from llfsm_verify.checking.claims import Claim, claim_of
from llfsm_verify.checking.confirm import Script
from llfsm_verify.checking.explaining.explain import explained
from llfsm_verify.checking.formula_goals import FormulaGoal
from llfsm_verify.checking.goals import Goal, Unconfirmed
from llfsm_verify.checking.kinds import goals_of
from llfsm_verify.checking.limits import Budget, memory_in_use
from llfsm_verify.checking.performing import Performer
from llfsm_verify.checking.replay import first_letter
from llfsm_verify.checking.searching import bad_prefixes_of, premised
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import (
    FaultFinding,
    FaultResult,
    Options,
    Progress,
    PropertyResult,
    Result,
    Verdict,
)
from llfsm_verify.kripke.explore import LimitReached
from llfsm_verify.logic.formula import apply, atom, is_plain
from llfsm_verify.logic.rewriting import nnf
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.program import Program

NAME = "bmc"
DEPTH = 60
"""Steps up to which runs are looked at, unless --depth says otherwise."""


class Reading(Protocol):
    """Something that reads a run beside it: a formula, or an automaton."""

    constraints: list[z3.BoolRef]

    def add(self, letter: Mapping[str, z3.BoolRef], observed: z3.BoolRef, loops: Loops) -> None: ...

    def holds(self) -> z3.BoolRef: ...

    def closed(self, loops: Loops) -> list[z3.BoolRef]: ...


class BoundedEngine:
    """Bounded model checking (``--engine bmc``). It finds violations, and proves nothing."""

    name = NAME

    def __init__(self, arithmetic: Arithmetic | None = None) -> None:
        """`arithmetic`: the theory of numbers (chosen by the program where None)."""
        self._arithmetic = arithmetic

    def check(self, arrangement: Arrangement, properties: Bound, options: Options) -> Result:
        """Faults and every property are violated, or unknown. Disagreement when a trace is not confirmed."""
        return _Session(arrangement, properties, options, self._arithmetic).run()


class _Task:
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

    @property
    def readings(self) -> list[Reading]:
        return self.context if self.wrong is None else [*self.context, self.wrong]


class _Session:
    def __init__(self, arrangement: Arrangement, bound: Bound, options: Options, arithmetic: Arithmetic | None) -> None:
        self._arrangement = arrangement
        self._bound = bound
        self._options = options
        self._budget = Budget(options.limits)
        self._effort = Effort(options.effort)
        self._goals = goals_of(bound, self._budget.tick)
        self._program = lower(arrangement, bound.atoms, keep_all_bits=options.keep_all_bits)
        self._terms = Terms(self._program, arithmetic)
        self._finite = self._terms.arithmetic.name == "bit-vectors"
        self._run = Unrolling(self._terms)
        self._loops = Loops(self._terms)
        self._loops.add(self._run.points[0])
        self._performer = Performer(arrangement, bound, self._budget.tick)
        self._assumed = [claim_of(p, bound.clock) for p in bound.assumptions]
        self._fair = [*premised(self._program), *_fairness(self._program)]
        self._faults: list[FaultFinding] = []
        self._fault_question = Question(self._budget, self._effort, finite=self._finite)

    def run(self) -> Result:
        started = time.monotonic()
        interrupted, why = False, None
        tasks: list[_Task] = []
        try:
            tasks = [self._task(goal) for goal in self._goals]
            why = self._search(tasks)
        except KeyboardInterrupt:
            interrupted, why = True, "interrupted"
        except (LimitReached, MemoryError) as limit:
            why = str(limit) or "the memory ran out"
        asked = {id(t.goal): t for t in tasks}
        results = tuple(self._result(goal, asked.get(id(goal)), why) for goal in self._goals)
        none = f"no run of up to {len(self._run)} steps ends in a fault" if why == self._reached else why
        faults = FaultResult(Verdict.UNKNOWN, (), none)
        if self._faults:
            faults = FaultResult(Verdict.VIOLATED, tuple(self._faults))
        return Result(
            arrangement=self._arrangement.name,
            path=self._arrangement.path,
            engine=NAME,
            complete=False,
            states=0,
            transitions=0,
            seconds=time.monotonic() - started,
            assumptions=tuple(p.name for p in self._bound.assumptions),
            properties=results,
            faults=faults,
            interrupted=interrupted,
            depth=len(self._run),
        )

    # ------------------------------------------------------------ what is asked

    def _task(self, goal: Goal) -> _Task:
        question = Question(self._budget, self._effort, finite=self._finite)
        tick = self._budget.tick
        name = goal.line.name
        watched, safe, limit = None, False, None
        try:
            monitor, safe = bad_prefixes_of(goal, tick)
            if monitor is not None:
                watched = Watched(monitor_table(monitor, goal.atoms, tick), f"{name}.bad")
        except AutomatonTooLarge as reached:
            limit = reached
        if watched is None and isinstance(goal, FormulaGoal):
            safe = False  # without the table of its monitor a safety property is looked at as any other
        task = _Task(goal, question, watched)
        try:
            if self._assumed:
                claims = [*self._assumed, *self._fair]
                task.context = [self._reading(c, f"{name}.{i}") for i, c in enumerate(claims)]
            if not safe:
                fair = [] if self._assumed else self._fair
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
        table = automaton_table(claim.automaton(self._budget.tick), claim.atoms, self._budget.tick)
        return AutomatonRun(table, name)

    def _wrong(self, goal: Goal, name: str) -> Reading:
        """The runs that violate a goal."""
        if isinstance(goal, FormulaGoal) and is_plain(goal.claim.formula):
            return Encoding(nnf(goal.claim.formula, negate=True), name)
        return AutomatonRun(automaton_table(goal.violations(self._budget.tick), goal.atoms, self._budget.tick), name)

    # ------------------------------------------------------------ looking

    def _search(self, tasks: Sequence[_Task]) -> str:
        """Look at longer and longer runs; why the search ended."""
        depth = self._options.depth or DEPTH
        while True:
            for task in tasks:
                if task.result is None:
                    self._read(task)
                    self._look(task)
            if len(self._run) >= depth:
                return self._reached
            if tasks and all(t.result is not None for t in tasks):
                return "every property is violated"
            if self._options.progress is not None:
                n = len(self._run)
                self._options.progress(Progress(0, n, n, n, self._budget.seconds, memory_in_use(), "asking the solver"))
            self._budget.check()
            self._look_for_faults()
            self._loops.add(self._run.extend())

    @property
    def _reached(self) -> str:
        return f"no run of up to {len(self._run)} steps violates it"

    def _read(self, task: _Task) -> None:
        """The readings read the last point."""
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
        return [n for f in self._program.fairness for n in (f.premise, f.goal) if n is not None]

    def _look(self, task: _Task) -> None:
        for question, prefix in self._questions(task):
            model = task.question.ask(question)
            if model is not None:
                self._found(task, model, None if prefix else self._loops.start(model))
                return

    def _questions(self, task: _Task) -> Iterator[tuple[list[z3.BoolRef], bool]]:
        """What would be a violation of the present length, and whether it is a bad prefix by itself."""
        if task.watched is not None:
            yield ([task.lost, *self._for_ever(task.context)], False) if self._assumed else ([task.bad], True)
        elif isinstance(task.wrong, Encoding) and not self._assumed:
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

    def _look_for_faults(self) -> None:
        here = self._run.begin()
        self._fault_question.learn(self._run.constraints)
        found = {self._program.faults.index(f.site) for f in self._faults}
        for number in range(len(self._program.faults)):
            condition = z3.simplify(here.fault(self._terms.arithmetic, number))
            if number in found or z3.is_false(condition):
                continue
            model = self._fault_question.ask([condition])
            if model is not None:
                self._faults.append(FaultFinding(self._program.faults[number], self._fault(number, model)))

    # ------------------------------------------------------------ what is found

    def _found(self, task: _Task, model: z3.ModelRef, start: int | None) -> None:
        goal, what = task.goal, f"property {task.goal.line.name}"
        script = self._script(model, len(self._run), start)
        first = first_letter(self._performer.execution, script)
        performance = self._performer.perform(script, first, what, self._performer.shown(goal, self._assumed))
        try:
            self._performer.confirm(goal, self._assumed, performance, what, prefix=start is None)
        except Unconfirmed as stop:
            reason = f"a violation was found, but not confirmed: {stop}"
            task.result = self._property(goal, Verdict.UNKNOWN, reason=reason)
            return
        task.result = self._property(goal, Verdict.VIOLATED, explained(performance, goal, self._bound))

    def _fault(self, number: int, model: z3.ModelRef) -> Trace:
        site = self._program.faults[number]
        script = self._script(model, len(self._run) + 1, None)
        first = first_letter(self._performer.execution, script)
        performance = self._performer.perform(script, first, f"fault {site.code}", ())
        self._performer.confirm_fault(site, performance)
        return performance.trace

    def _script(self, model: z3.ModelRef, steps: int, start: int | None) -> Script:
        """The first `steps` steps of a model; `start`: the point that the loop comes back to."""
        return script_of(self._run, model, steps, start)

    def _result(self, goal: Goal, task: _Task | None, why: str | None) -> PropertyResult:
        if task is not None and task.result is not None:
            return task.result
        if task is not None and task.limit is not None:
            why = f"{task.limit}; and {why}"
        return self._property(goal, Verdict.UNKNOWN, reason=why)

    def _property(
        self, goal: Goal, verdict: Verdict, trace: Trace | None = None, reason: str | None = None
    ) -> PropertyResult:
        line = goal.line
        assert line.kind != "assume"
        return PropertyResult(line.name, line.kind, line.text, line.span, verdict, NAME, trace, reason)


def _fairness(program: Program) -> list[Claim]:
    """Fairness without a premise, as claims over its outputs."""
    return [Claim(apply("G", apply("F", atom(f.goal)))) for f in program.fairness if f.premise is None]
