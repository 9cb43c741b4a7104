"""Violations and faults in runs of growing length, for the engines that look for them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import z3

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Arithmetic
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.claims import Claim, add_premises, claim_of, unconditional
from llfsm_verify.checking.engine import Answer, Given, Unknown, Violated
from llfsm_verify.checking.goals.automata import RegularGoal
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, bad_prefixes_of
from llfsm_verify.checking.goals.kinds import FormulaGoal
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.verdict import Exploration, Progress
from llfsm_verify.engines.unrolled.encoding import Encoding, Loops
from llfsm_verify.engines.unrolled.question import Question, schedule_of
from llfsm_verify.engines.unrolled.runs import AutomatonRun, Watched, automaton_table, monitor_table
from llfsm_verify.limits import memory_in_use
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
    """A property: its bad prefixes, by a monitor, and its violations forever, by readings."""

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
        self.found: Violated | None = None
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
    """Runs of growing length, asked for faults and for violations of every property."""

    def __init__(self, given: Given, arithmetic: Arithmetic | None = None) -> None:
        """`arithmetic`: the theory of numbers (chosen by the program where None)."""
        problem = given.problem
        self._options = given.options
        self.budget = given.budget
        self.goals = given.goals
        self._found = given.found
        self.program = problem.program(keep_all_bits=given.options.keep_all_bits)
        self._terms = Terms(self.program, arithmetic)
        self._finite = self._terms.arithmetic.name == "bit-vectors"
        self._run = Unrolling(self._terms)
        self._loops = Loops(self._terms)
        self._loops.add(self._run.points[0])
        self.replayer = Replayer(problem)
        self.assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        self.fair = [*add_premises(self.program), *unconditional(self.program)]
        self.faults: dict[int, Violated] = {}
        """By the number of the fault: a run that ends in it, confirmed, since the executor's numbers have an end."""
        self.unperformed = ""
        """Why the executor cannot perform the first run into a fault that it refuses."""
        self.effort = SolverBudget(given.options.effort)
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
            if task.found is None and task.points < len(self._run.points):
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
                start = None if prefix else self._loops.start(model)
                task.found = Violated(schedule_of(self._run, model, len(self._run), start))
                self._found(task.goal)
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
        """Look for steps after the present length that end in a fault."""
        here = self._run.begin()
        self._fault_question.learn(self._run.constraints)
        for number in range(len(self.program.faults)):
            condition = z3.simplify(here.fault(self._terms.arithmetic, number))
            if number in self.faults or z3.is_false(condition):
                continue
            model = self._fault_question.ask([condition], self.budget)
            if model is not None:
                self._look_into(number, Violated(schedule_of(self._run, model, len(self._run) + 1)))

    def _look_into(self, number: int, run: Violated) -> None:
        """Keep a run into a fault, unless the executor's 64 bits end it before: then longer ones are looked at."""
        try:
            self.replayer.fault(number, run)
        except Unconfirmed as why:
            self.unperformed = self.unperformed or str(why)
            return
        self.faults[number] = run
        self._found(None)

    # ------------------------------------------------------------ what is known

    def answer(self, task: Task | None, why: str | None) -> Answer:
        """What was found, else that it is unknown: `why`. `task` None: it was never asked for."""
        if task is not None and task.found is not None:
            return task.found
        if task is not None and task.limit is not None:
            why = f"{task.limit}; and {why}" if task.is_asked else task.limit
        return Unknown(why or "it was not looked at")

    @property
    def exploration(self) -> Exploration:
        """An engine that counts no configurations."""
        return Exploration(depth=len(self))
