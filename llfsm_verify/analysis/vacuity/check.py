"""Every property that holds is looked at for what makes it hold vacuously, in the graph that has been explored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal, cast

from llfsm_verify.analysis.vacuity.escapes import escape_finding
from llfsm_verify.analysis.vacuity.letters import Letters
from llfsm_verify.analysis.vacuity.subformulas import Holds, TooManySubformulas, findings
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.satisfiability import contradict, forbids, is_satisfiable, is_valid
from llfsm_verify.checking.engine import Explored
from llfsm_verify.checking.goals.formulas import FormulaGoal
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.vacuity import NO_RUN, Escape, Looked, Vacuity, VacuityFinding
from llfsm_verify.checking.verdict import Options, PropertyResult, Verdict
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.logic.formula import EXPRESSIONS, Formula, apply, negation, to_text
from llfsm_verify.logic.properties import Property
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.stages import stage

if TYPE_CHECKING:
    from llfsm_verify.checking.goals.automata import AutomatonGoal
    from llfsm_verify.checking.goals.regular import RegularGoal

LIMITS = (LimitReached, AutomatonTooLarge, ExpressionTooLarge, TooManySubformulas, MemoryError)
"""What ends the look at one property."""


VALID = "every run of any arrangement satisfies it"
SHARE, LEAST = 0.1, 0.1
"""Without being asked for, looking takes this share of the time of the check, and so many seconds more, at most."""
ASKED_SHARE, ASKED_LEAST = 1.0, 60.0
"""The same when it was asked for."""


@stage("looking at what a pass is worth")
def check_vacuity(
    explored: Explored,
    possible: bool | None,
    problem: Problem,
    goals: Sequence[Goal],
    results: tuple[PropertyResult, ...],
    options: Options,
    budget: Budget,
    escape: Escape | None = None,
) -> tuple[PropertyResult, ...]:
    """The results of a check of a space that was explored to its end, looked at as far as the options want.
    `possible`: some run satisfies the assumptions; None: that is not known. `escape`: what is known of runs that escape
    them."""
    wish = Wish("all" if _asked(options) else "antecedents", options.accepted)
    return Examination(explored, possible, problem, wish, share_of(options, budget), escape).of_all(results, goals)


def share_of(options: Options, budget: Budget, least: float = LEAST) -> Budget:
    """What one way of looking at passes may take of a check; `least` seconds in any case, without being asked for."""
    share, least = (ASKED_SHARE, ASKED_LEAST) if _asked(options) else (SHARE, least)
    seconds = least + share * budget.seconds
    if options.limits.timeout is not None:
        seconds = min(seconds, max(0.0, options.limits.timeout - budget.seconds))
    return Budget(replace(options.limits, timeout=seconds))


def _asked(options: Options) -> bool:
    return options.strict or options.vacuity == "all"


@dataclass(frozen=True, slots=True)
class Wish:
    """How far to look, and at which properties findings are known."""

    extent: Literal["antecedents", "all"]
    accepted: frozenset[str] = frozenset()


class Examination:
    """Looks at the results of one check within a budget."""

    def __init__(
        self,
        explored: Explored,
        possible: bool | None,
        problem: Problem,
        wish: Wish,
        budget: Budget,
        escape: Escape | None = None,
    ) -> None:
        self._explored = explored
        self._possible = possible
        self._problem = problem
        self._wish = wish
        self._budget = budget
        self._escape = escape or Escape()
        self._letters = Letters(explored)

    def of_all(self, results: Sequence[PropertyResult], goals: Sequence[Goal]) -> tuple[PropertyResult, ...]:
        """The results with what was found about those that hold, or are violated whatever the arrangement."""
        with self._budget:
            return tuple(replace(r, vacuity=self._of(r, g)) for r, g in zip(results, goals, strict=True))

    def _of(self, result: PropertyResult, goal: Goal) -> Vacuity:
        if result.verdict is Verdict.VIOLATED:
            return Vacuity(tuple(self._unsatisfiable(goal)))
        if result.verdict is not Verdict.HOLDS:
            return Vacuity()
        keys = goal.atoms
        never, always = self._letters.never(keys), self._letters.always(keys)
        found: list[VacuityFinding] = []
        looked: Looked = self._wish.extent
        reason = self._escape.reason
        if reason is not None:
            looked = "antecedents"
        if self._escape.trace is not None:
            found.append(escape_finding(self._problem, self._escape.trace))
        try:
            self._budget.check()
            found.extend(self._findings(goal, never))
        except LIMITS as limit:
            looked, reason = "no", f"not checked for vacuity: {str(limit) or 'the memory ran out'}"
        accepted = result.name in self._wish.accepted
        return Vacuity(tuple(found), looked, reason, never, always, accepted)

    def _findings(self, goal: Goal, never: Sequence[str]) -> Iterator[VacuityFinding]:
        if not self._possible:
            yield from self._assumptions()
            return
        if goal.line.file is not None:
            from llfsm_verify.analysis.vacuity.automata import automaton_findings

            yield from automaton_findings(cast("AutomatonGoal", goal), never)
            return
        formula = formula_of(goal.line)
        if formula is None:
            yield from self._rule(cast("RegularGoal", goal))
            return
        found = False
        everything, assumed = self._wish.extent == "all", bool(self._problem.assumptions)
        holds = partial(self._holds, goal.line)
        for finding in formula_findings(formula, holds, everything=everything, assumed=assumed):
            found = True
            yield finding
        if not found:
            yield from self._constant(formula, never)

    def _holds(self, line: Property, formula: Formula) -> bool:
        """Whether a formula holds that is no weaker than the line."""
        known = None if self._problem.assumptions else self._letters.decide(formula)
        if known is not None:
            return known
        stronger = stronger_line(line, formula, line.name)
        return not self._explored.violates(FormulaGoal(stronger, self._problem.clock))

    def _constant(self, formula: Formula, never: Sequence[str]) -> Iterator[VacuityFinding]:
        """Atoms that never hold, though the formula does not say so."""
        for key in never:
            if not forbids(formula, key):
                yield VacuityFinding("letter", f"`{key}` never holds in any configuration reached", key)

    def _rule(self, goal: RegularGoal) -> Iterator[VacuityFinding]:
        """That a rule is valid, else letters of its expression that match nothing."""
        if goal.monitor().bad_prefix() is None:
            yield VacuityFinding("valid", VALID, goal.line.text)
            return
        assert goal.line.expression is not None
        from llfsm_verify.logic.expressions import letters

        for letter in self._letters.unmatched(letters(goal.line.expression)):
            text = to_text(letter)
            yield VacuityFinding("letter", f"`{text}` matches no configuration reached", text)

    def _unsatisfiable(self, goal: Goal) -> Iterator[VacuityFinding]:
        formula = formula_of(goal.line)
        try:
            if goal.line.file is not None:
                from llfsm_verify.analysis.vacuity.automata import allows_nothing

                if allows_nothing(cast("AutomatonGoal", goal)):
                    yield VacuityFinding("unsatisfiable", "no run of any arrangement satisfies it", goal.line.text)
            if formula is not None and is_satisfiable(formula) is False:
                text = to_text(formula)
                yield VacuityFinding("unsatisfiable", "no run of any arrangement satisfies it", text)
        except LIMITS:
            return  # the verdict stands, and says more

    def _assumptions(self) -> Iterator[VacuityFinding]:
        if self._possible is None:
            raise LimitReached("whether any run satisfies the assumptions is not known")
        yield assumptions_finding(self._problem)


def formula_findings(formula: Formula, holds: Holds, *, everything: bool, assumed: bool) -> Iterator[VacuityFinding]:
    """That a formula which holds is valid, else what `subformulas.findings` tells of it."""
    if is_valid(formula):
        yield VacuityFinding("valid", VALID, to_text(formula))
        return
    yield from findings(formula, holds, everything=everything, assumed=assumed)


def stronger_line(line: Property, formula: Formula, name: str) -> Property:
    """A line that claims a formula in place of what `line` claims."""
    text = to_text(formula)
    return replace(line, name=name, kind="ltl", formula=formula, expression=None, file=None, text=text)


def assumptions_finding(problem: Problem) -> VacuityFinding:
    """No run satisfies the assumptions; is it their own fault?"""
    names = [p.name for p in problem.assumptions]
    formulas = [p.formula for p in problem.assumptions if p.formula is not None]
    message = NO_RUN
    try:
        if contradict(formulas):
            many = len(names) > 1
            alone = "the assumptions contradict each other" if many else f"nothing ever satisfies {names[0]}"
            message = f"{NO_RUN}: {alone}, whatever the arrangement"
    except LIMITS:
        pass  # the finding stands without its reason
    return VacuityFinding("assumptions", message, ", ".join(names))


def formula_of(line: Property) -> Formula | None:
    """What a line claims as a formula of temporal logic; a rule of one letter is one."""
    if line.formula is not None:
        return line.formula
    if line.kind == "forbid" and line.expression is not None and line.expression.op not in EXPRESSIONS:
        return apply("G", negation(line.expression))
    return None
