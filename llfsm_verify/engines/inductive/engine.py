"""Engines that prove: k-induction and property-directed reachability. Proofs are certified by fresh solvers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.satisfiability import contradict
from llfsm_verify.backends.smt.relation import NumberTooLarge
from llfsm_verify.checking.engine import Answer, Given, Holds, Session, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.goals.kinds import impossible
from llfsm_verify.checking.verdict import Exploration, Progress
from llfsm_verify.diagnostics import counted
from llfsm_verify.engines.inductive.provers import Induction, Spacer
from llfsm_verify.engines.inductive.proving import Open, Proving, Settled
from llfsm_verify.engines.inductive.system import Prover
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.engines.unrolled.search import DEPTH, BoundedSearch, Task
from llfsm_verify.limits import memory_in_use

FIRST_STEPS = 12
"""Violations within so many steps are looked for before anything is to be proved."""
REACHED_DEPTH = 1_000
"""Steps up to which a run is looked for that a prover says there is."""
EFFORTS = (0.02, 1, 4)
"""What is not known after the first attempt is tried again, with more of the prover's work; not where the user of an
engine limits it. A short one comes first: what is hard is not to keep what is easy waiting."""
BETWEEN_STEPS = 40
"""Violations within so many steps are looked for between the first attempt and the longer ones."""


def induction(given: Given) -> Session:
    """``--engine induction``."""
    return InductiveSession(given, Induction())


def pdr(given: Given) -> Session:
    """``--engine pdr``."""
    return InductiveSession(given, Spacer())


class InductiveSession(Session):
    """Proofs for unbounded time and data. Disagreement: solvers contradict each other."""

    asks_again = True

    def __init__(self, given: Given, prover: Prover) -> None:
        self._given = given
        self._options = given.options
        self._prover = prover
        self._search = BoundedSearch(given)
        self._proving = Proving(self._search, given.problem, prover, given.options.of(UnrolledOptions).depth)
        self._tasks: list[Task] = []
        self._possible: Task | None = None
        """Looks for a run that satisfies the assumptions, where there are any: a violation of what is never true."""
        self._seen_possible: bool | None = None
        """Such a run was found, and confirmed (True) or not (False)."""
        self._contradictory = False
        """The assumptions contradict each other, whatever the arrangement."""
        self._known: dict[int, Settled | Open] = {}
        """By `id` of the goal; by 0 that of the faults."""
        self._why: str | None = None
        """What ended the search before its end."""

    # ------------------------------------------------------------ what is done

    def search(self) -> None:
        """Look for short violations, prove, and look for longer ones where that does not succeed."""
        search = self._search
        self._tasks = [search.task(goal) for goal in search.goals]
        if search.assumed and search.goals:
            self._possible = search.task(impossible(search.goals[0].line, self._given.problem.clock))
        self._look(self._tasks, FIRST_STEPS)
        for number, effort in enumerate(self._efforts):
            if number == 1:
                self._look(self._unproved, BETWEEN_STEPS)
            if self._options.faults and not search.faults and not self._is_settled(0):
                self._tell("faults")
                self._known[0] = self._proving.faults(effort)
                self._given.found(None)
            for task in sorted(self._tasks, key=lambda t: t.wrong is not None):  # safety is proved sooner
                if task.found is None and not self._is_settled(id(task.goal)):
                    self._tell(task.goal.line.name)
                    self._known[id(task.goal)] = self._proving.goal(task.goal, effort)
                    if self._holds(id(task.goal)):
                        self._given.found(task.goal)
        if self._options.effort is None:
            left = self._unproved
            self._look(left, DEPTH)
            self._look([t for t in left if self._is_reached(id(t.goal))], REACHED_DEPTH)
        if self._is_doubtful and any(self._holds(id(goal)) for goal in search.goals):
            self._look_at_assumptions()

    @property
    def _unproved(self) -> list[Task]:
        """What may be violated."""
        return [t for t in self._tasks if t.found is None and not self._holds(id(t.goal))]

    @property
    def _efforts(self) -> tuple[int, ...]:
        """The work of the prover for a question, attempt by attempt."""
        full, most = self._prover.effort, self._options.effort
        return tuple(int(full * times) for times in EFFORTS) if most is None else (full,)

    def _look_at_assumptions(self) -> None:
        """Whether any run satisfies them, of which a very short one would be known by now."""
        assert self._possible is not None
        self._tell("the assumptions")
        formulas = [p.formula for p in self._given.problem.assumptions if p.formula is not None]
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
        while any(t.found is None for t in tasks) or self._wants_fault:
            search.look([*tasks, *always])
            self._confirm_possible()
            if len(search) >= depth:
                return
            if self._wants_fault:
                search.look_for_faults()
            try:
                search.extend()
            except NumberTooLarge:  # longer runs cannot be looked at; proofs look at none
                return

    def _confirm_possible(self) -> None:
        """A run that satisfies the assumptions counts only after the executor has performed it."""
        task = self._possible
        if task is not None and task.found is not None and self._seen_possible is None:
            try:
                self._search.replayer.violation(task.goal, task.found)
                self._seen_possible = True
            except Unconfirmed:
                self._seen_possible = False

    @property
    def _is_doubtful(self) -> bool:
        """No run was found that satisfies the assumptions."""
        return self._possible is not None and self._possible.found is None

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
        return isinstance(self._known.get(key), Settled)

    def _holds(self, key: int) -> bool:
        answer = self._known.get(key)
        return isinstance(answer, Settled) and answer.holds

    def _is_reached(self, key: int) -> bool:
        return self._is_settled(key) and not self._holds(key)

    # ------------------------------------------------------------ what is known

    def ended(self, why: str | None) -> None:
        self._why = why

    def answers(self, goal: Goal) -> Iterator[Answer]:
        known = self._known.get(id(goal))
        if isinstance(known, Settled) and known.holds:
            yield Holds(known.proofs)
            return
        task = next((t for t in self._tasks if t.goal is goal), None)
        none = f"no run of up to {counted(len(self._search), 'step')} violates it"
        unknown = self._unknown(id(goal), none)
        answer = self._search.answer(task, unknown.reason)
        if isinstance(answer, Unknown):
            yield replace(answer, refuted=unknown.refuted)
        else:
            yield answer
            yield unknown

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        yield from self._search.faults.items()

    def faults(self) -> Holds | Unknown:
        known = self._known.get(0)
        if isinstance(known, Settled) and known.holds:
            return Holds(known.proofs)
        none = f"no run of up to {counted(len(self._search), 'step')} ends in a fault"
        if self._search.unperformed:
            none += f" that the executor can perform: {self._search.unperformed}"
        return self._unknown(0, none)

    def possible(self) -> bool | None:
        if self._possible is None or self._seen_possible:
            return True
        return False if self._contradictory else None

    def exploration(self) -> Exploration:
        return self._search.exploration

    def _unknown(self, key: int, none: str) -> Unknown:
        """Why something is not known. `none`: what was looked for, and not found."""
        known = self._known.get(key)
        refuted = isinstance(known, Settled)
        if self._why is not None:
            before = f"; before that, {known.reason}" if isinstance(known, Open) else ""
            return Unknown(f"{self._why}{before}", refuted)
        if isinstance(known, Open):
            return Unknown(f"{known.reason}; and {none}")
        return Unknown(f"it is violated, says {self._prover.name}, but {none}", refuted)
