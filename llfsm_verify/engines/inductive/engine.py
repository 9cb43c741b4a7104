"""Engines that prove: k-induction and property-directed reachability. Proofs are certified, violations confirmed."""

from __future__ import annotations

import time
from collections.abc import Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.validity import contradict
from llfsm_verify.backends.smt.sizes import NumberTooLarge
from llfsm_verify.checking.goals.formulas import impossible
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.vacuity import NO_RUN, PERHAPS_NO_RUN
from llfsm_verify.checking.verdict import FaultResult, Options, Progress, PropertyResult, Result, Verdict
from llfsm_verify.engines.inductive.induction import Induction
from llfsm_verify.engines.inductive.prover import Prover
from llfsm_verify.engines.inductive.proving import Open, Proving, Settled
from llfsm_verify.engines.inductive.spacer import Spacer
from llfsm_verify.engines.inductive.vacuity import ProvedPasses, unexamined
from llfsm_verify.engines.unrolled.search import DEPTH, BoundedSearch, Task
from llfsm_verify.limits import LimitReached, memory_in_use

FIRST_STEPS = 12
"""Violations within so many steps are looked for before anything is to be proved."""
REACHED_DEPTH = 1_000
"""Steps up to which a run is looked for that a prover says there is."""
EFFORTS = (1, 4)
"""What is not known after the first attempt is tried once more, with more of the prover's work; not where the user of
an engine limits it."""


class InductiveEngine:
    """Proofs for unbounded time and data (``--engine induction`` and ``pdr``)."""

    def __init__(self, prover: Prover) -> None:
        self._prover = prover
        self.name = prover.name

    def check(self, problem: Problem, options: Options) -> Result:
        """Verdicts for faults and properties. Disagreement when a trace is not confirmed, or solvers contradict."""
        return _Session(problem, options, self._prover).run(examine=True)


def induction() -> InductiveEngine:
    return InductiveEngine(Induction())


def pdr() -> InductiveEngine:
    return InductiveEngine(Spacer())


class _Session:
    def __init__(self, problem: Problem, options: Options, prover: Prover) -> None:
        self._options = options
        self._problem = problem
        self._prover = prover
        self._search = BoundedSearch(problem, options, prover.name)
        self._proving = Proving(self._search, problem, prover, options.depth)
        self._tasks: list[Task] = []
        self._possible: Task | None = None
        """Looks for a run that satisfies the assumptions, where there are any: a violation of what is never true."""
        self._contradictory = False
        """The assumptions contradict each other, whatever the arrangement."""
        self._answers: dict[int, Settled | Open] = {}
        """By `id` of the goal; by 0 that of the faults."""

    def run(self, *, examine: bool) -> Result:
        """`examine`: look at what makes a pass empty, too."""
        with self._search.budget:
            return self._run(examine=examine)

    def _run(self, *, examine: bool) -> Result:
        started = time.monotonic()
        interrupted, why = False, None
        try:
            self._work()
        except KeyboardInterrupt:
            interrupted, why = True, "interrupted"
        except (LimitReached, MemoryError) as limit:
            why = str(limit) or "the memory ran out"
        search = self._search
        results = tuple(self._result(i, why) for i in range(len(search.goals)))
        faults = self._faults(why)
        if why is not None:
            results = unexamined(results, why)
        elif examine:
            try:
                passes = ProvedPasses(self._problem, self._options)
                results = passes.examined(results, search.goals, self._decided, possible=self._are_possible)
            except KeyboardInterrupt:
                interrupted = True
        verdicts = [*(r.verdict for r in results), faults.verdict]
        seconds, complete = time.monotonic() - started, Verdict.UNKNOWN not in verdicts
        return search.whole(results, faults, seconds=seconds, complete=complete, interrupted=interrupted)

    # ------------------------------------------------------------ what is done

    def _work(self) -> None:
        search = self._search
        self._tasks = [search.task(goal) for goal in search.goals]
        if search.assumed and search.goals:
            self._possible = search.task(impossible(search.goals[0].line, self._problem.clock))
        self._look(self._tasks, FIRST_STEPS)
        for effort in self._efforts:
            if self._options.faults and not search.faults and not self._is_settled(0):
                self._tell("faults")
                self._answers[0] = self._proving.faults(effort)
            for task in sorted(self._tasks, key=lambda t: t.wrong is not None):  # safety is proved sooner
                if task.result is None and not self._is_settled(id(task.goal)):
                    self._tell(task.goal.line.name)
                    self._answers[id(task.goal)] = self._proving.goal(task.goal, effort)
        if self._options.effort is None:
            left = [t for t in self._tasks if t.result is None and not self._holds(id(t.goal))]
            self._look(left, DEPTH)
            self._look([t for t in left if self._is_reached(id(t.goal))], REACHED_DEPTH)
        if self._is_doubtful and any(self._holds(id(goal)) for goal in search.goals):
            self._look_at_assumptions()

    @property
    def _efforts(self) -> tuple[int, ...]:
        """The work of the prover for a question, attempt by attempt."""
        full, most = self._prover.effort, self._options.effort
        return tuple(full * times for times in EFFORTS) if most is None else (full,)

    def _look_at_assumptions(self) -> None:
        """Whether any run satisfies them, of which a very short one would be known by now."""
        assert self._possible is not None
        self._tell("the assumptions")
        formulas = [p.formula for p in self._problem.assumptions if p.formula is not None]
        try:
            self._contradictory = contradict(formulas)
        except AutomatonTooLarge:
            pass  # then it is not known
        if not self._contradictory:
            self._look([self._possible], DEPTH)

    def _look(self, tasks: Sequence[Task], depth: int) -> None:
        """Look at runs of up to `depth` steps, if they are longer than those looked at."""
        search = self._search
        always = [] if self._possible is None else [self._possible]
        while any(t.result is None for t in tasks) or self._wants_fault:
            search.look([*tasks, *always])
            if len(search) >= depth:
                return
            if self._wants_fault:
                search.look_for_faults()
            try:
                search.extend()
            except NumberTooLarge:  # longer runs cannot be looked at; proofs look at none
                return

    @property
    def _is_doubtful(self) -> bool:
        """No run was found that satisfies the assumptions."""
        return self._possible is not None and self._possible.result is None

    @property
    def _wants_fault(self) -> bool:
        """A fault is still looked for: there may be one, and none was found."""
        return self._options.faults and not self._search.faults and not self._holds(0)

    def _tell(self, name: str) -> None:
        budget = self._search.budget
        budget.check()
        if self._options.progress is not None:
            n = len(self._search)
            self._options.progress(Progress(0, n, n, n, budget.seconds, memory_in_use(), f"proving {name}"))

    def _is_settled(self, key: int) -> bool:
        return isinstance(self._answers.get(key), Settled)

    def _holds(self, key: int) -> bool:
        answer = self._answers.get(key)
        return isinstance(answer, Settled) and answer.holds

    def _is_reached(self, key: int) -> bool:
        return self._is_settled(key) and not self._holds(key)

    def _decided(self, problem: Problem, effort: int) -> dict[str, bool | None]:
        """Whether other properties hold, with little work."""
        limits, left = self._options.limits, self._search.budget.left
        limits = limits if left is None else limits.within(left)
        other = _Session(problem, Options(limits, effort=effort, faults=False), self._prover)
        result = other.run(examine=False)
        if result.interrupted:
            raise KeyboardInterrupt
        goals = other._search.goals
        return {
            r.name: None
            if r.verdict is Verdict.UNKNOWN and not other._is_reached(id(g))
            else r.verdict is Verdict.HOLDS
            for r, g in zip(result.properties, goals, strict=True)
        }

    # ------------------------------------------------------------ what is known

    def _reason(self, key: int, why: str | None, none: str) -> str:
        """Why something is not known."""
        answer = self._answers.get(key)
        if why is not None:
            return why
        if isinstance(answer, Open):
            return f"{answer.reason}; and {none}"
        return f"it is violated, says {self._prover.name}, but {none}"

    def _result(self, number: int, why: str | None) -> PropertyResult:
        goal = self._search.goals[number]
        task = next((t for t in self._tasks if t.goal is goal), None)
        answer = self._answers.get(id(goal))
        none = f"no run of up to {len(self._search):,} steps violates it"
        if isinstance(answer, Settled) and answer.holds:
            return self._search.held(goal, answer.proofs, self._doubts)
        return self._search.result(goal, task, self._reason(id(goal), why, none))

    @property
    def _are_possible(self) -> bool | None:
        """Whether some run satisfies the assumptions; None: that is not known."""
        possible = self._possible
        if possible is None or (possible.result is not None and possible.result.verdict is Verdict.VIOLATED):
            return True
        return False if self._contradictory else None

    @property
    def _doubts(self) -> tuple[str, ...]:
        """What is to be said of everything that holds."""
        return {True: (), False: (NO_RUN,), None: (PERHAPS_NO_RUN,)}[self._are_possible]

    def _faults(self, why: str | None) -> FaultResult:
        search = self._search
        if search.faults:
            return FaultResult(Verdict.VIOLATED, tuple(search.faults))
        answer = self._answers.get(0)
        if isinstance(answer, Settled) and answer.holds:
            return FaultResult(Verdict.HOLDS, (), proofs=answer.proofs)
        none = f"no run of up to {len(search):,} steps ends in a fault"
        return FaultResult(Verdict.UNKNOWN, (), self._reason(0, why, none))
