"""Short runs by a solver: outcomes that an exploration has no time to show, where inputs or numbers are wide."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import z3

from llfsm_verify.analysis.lint.local import EFFORT
from llfsm_verify.backends.smt.arithmetic import BitVectors
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.sizes import NumberTooLarge
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.engines.unrolled.question import Exhausted, Question
from llfsm_verify.engines.unrolled.schedules import schedule_of
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.semantics.probes import Outcome
from llfsm_verify.transforms.probing import Probed

DEPTH = 20
"""Steps of the longest runs that are looked at."""


class ShortRuns:
    """Shortest runs of up to `depth` steps to as many of the outcomes `wanted` as a solver finds.

    They show outcomes, and prove of none that it never comes out.
    """

    complete = False

    def __init__(self, probed: Probed, wanted: Iterable[Outcome], budget: Budget, depth: int = DEPTH) -> None:
        self.probed = probed
        self._found: dict[Outcome, Schedule] = {}
        self._open = list(wanted)
        self._run = Unrolling(Terms(probed.program))
        self._question = Question(finite=isinstance(self._run.terms.arithmetic, BitVectors), effort=EFFORT)
        try:
            while self._open and len(self._run) < depth:
                self._run.extend()
                self._look(budget)
        except (LimitReached, NumberTooLarge):
            return

    def _look(self, budget: Budget) -> None:
        """Which outcomes can come out in the last step of the run so far; each model tells of several."""
        self._question.learn(self._run.constraints)
        letter, names = self._run.points[-1].letter, self.probed.outputs
        while self._open:
            budget.check()
            try:
                model = self._question.ask([z3.Or([letter[names[o]] for o in self._open])], budget)
            except Exhausted:
                return
            if model is None:
                return
            shown = [o for o in self._open if z3.is_true(model.eval(letter[names[o]], model_completion=True))]
            schedule = schedule_of(self._run, model, len(self._run))
            self._found |= dict.fromkeys(shown, schedule)
            self._open = [o for o in self._open if o not in self._found]

    def keep(self, fits: Callable[[Schedule], bool]) -> None:
        """Forget the runs that the executor cannot perform: the solver's integers have no end."""
        kept = {id(s): fits(s) for s in self._found.values()}
        self._found = {o: s for o, s in self._found.items() if kept[id(s)]}

    def has(self, outcome: Outcome) -> bool:
        """A run was found in which it comes out."""
        return outcome in self._found

    def run_to(self, outcome: Outcome) -> Schedule:
        """A shortest run whose last step has the outcome. KeyError where none was found."""
        return self._found[outcome]
