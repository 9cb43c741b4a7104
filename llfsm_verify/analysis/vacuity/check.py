"""Every property that holds is looked at for what makes it hold vacuously, in the graph that has been explored: atoms
that never or always hold, antecedents that are never true, subformulas that do not matter, escaped assumptions.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import and_, or_
from typing import TYPE_CHECKING, Literal, cast

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.satisfiability import contradict, forbids, is_satisfiable, is_valid
from llfsm_verify.checking.engine import Explored
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, shown_atoms
from llfsm_verify.checking.goals.kinds import FormulaGoal
from llfsm_verify.checking.problem import Problem, are_about_world
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import (
    NO_RUN,
    Escape,
    Looked,
    Options,
    PropertyResult,
    Vacuity,
    VacuityFinding,
    Verdict,
)
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.logic.formula import (
    EXPRESSIONS,
    FALSE,
    TRUE,
    Formula,
    apply,
    atom,
    atoms,
    is_boolean,
    negation,
    to_text,
)
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import Property
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.logic.rewriting.strengthening import Occurrence, consequent, parts, replace_subformula
from llfsm_verify.stages import stage

if TYPE_CHECKING:
    from llfsm_verify.checking.goals.automata import AutomatonGoal, RegularGoal


MOST_LETTERS = 5_000
"""Letters that are asked one by one; where there are more, a search is faster."""


class Letters:
    """Every letter of a complete graph."""

    def __init__(self, explored: Explored) -> None:
        self._masks = explored.masks
        self._bits = {name: i for i, name in enumerate(explored.names)}

    @cached_property
    def _letters(self) -> list[frozenset[str]]:
        """By the keys of the atoms that hold."""
        return [frozenset(name for name, i in self._bits.items() if mask >> i & 1) for mask in self._masks]

    def __contains__(self, key: str) -> bool:
        return key in self._bits

    def never(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that no letter shows."""
        shown = reduce(or_, self._masks, 0)
        return tuple(k for k in keys if k in self._bits and not shown >> self._bits[k] & 1)

    def always(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that every letter shows."""
        shown = reduce(and_, self._masks, -1 if self._masks else 0)
        return tuple(k for k in keys if k in self._bits and shown >> self._bits[k] & 1)

    def unmatched(self, formulas: Sequence[Formula]) -> list[Formula]:
        """The state formulas that no letter satisfies."""
        return [f for f in formulas if not any(evaluate(f, (), (letter,)) for letter in self._letters)]

    def decide(self, formula: Formula) -> bool | None:
        """Whether `G f`, or a conjunction of such, with state formulas f holds without assumptions; None: this is not
        told by letters alone, or there are too many of them."""
        if len(self._masks) > MOST_LETTERS or not self._bits.keys() >= set(atoms(formula)):
            return None
        if formula.op == "and":
            answers = [self.decide(part) for part in formula.args]
            return False if False in answers else None if None in answers else True
        if formula.op != "G" or not is_boolean(formula.args[0]):
            return None
        return all(evaluate(formula.args[0], (), (letter,)) for letter in self._letters)


ESCAPE_LEAST = 2.0
"""Seconds that looking may take at least, without being asked for: it is one search of what was searched before."""
NOT_LOOKED = "whether the arrangement escapes the assumptions was not examined"


def look_for_escape(explored: Explored, replayer: Replayer, problem: Problem, budget: Budget) -> Escape:
    """The nearest escape in a space that was explored to its end, and in which some run meets the assumptions."""
    if are_about_world(problem):
        return Escape()
    try:
        with budget:
            budget.check()
            found = explored.escape()
            return Escape() if found is None else Escape(replayer.escape(found))
    except (LimitReached, AutomatonTooLarge, Unconfirmed, MemoryError) as limit:
        return Escape(reason=f"{NOT_LOOKED}: {str(limit) or 'the memory ran out'}")


def not_looked_for(problem: Problem, why: str) -> Escape:
    """What is known where no engine can look; `why`."""
    return Escape() if are_about_world(problem) else Escape(reason=f"{NOT_LOOKED}: {why}")


def escape_finding(problem: Problem, trace: Trace) -> VacuityFinding:
    """What an escape says of everything that holds."""
    steps = len(trace.steps)
    where = f"after step {steps} of a run" if steps else "from an initial configuration"
    message = f"{where} no continuation meets the assumptions, so what happens then does not count"
    return VacuityFinding("escape", message, ", ".join(p.name for p in problem.assumptions))


MOST_SUBFORMULAS = 200
"""Occurrences of subformulas that are looked at; formulas with more are written by programs."""

Holds = Callable[[Formula], bool]


class TooManySubformulas(Exception):
    """A formula has more occurrences of subformulas than are looked at."""


def findings(formula: Formula, holds: Holds, *, everything: bool, assumed: bool = False) -> Iterator[VacuityFinding]:
    """What is vacuous in `formula`, which holds: outermost first, and nothing inside of what was found.

    `holds` decides a stronger formula, under assumptions when `assumed`. Without `everything` only the consequents of
    implications are replaced. Raises
    TooManySubformulas, and what `holds` raises, after what was found before.
    """
    todo = deque([Occurrence(formula)])
    looked = 0
    while todo:
        place = todo.popleft()
        looked += 1
        if looked > MOST_SUBFORMULAS:
            raise TooManySubformulas(f"it has more than {MOST_SUBFORMULAS} subformulas")
        right = consequent(place)
        if right is not None:
            stronger = replace_subformula(formula, right.path, FALSE)
            if stronger not in (TRUE, FALSE) and right.node is not FALSE and holds(stronger):
                yield _never(place, stronger, formula, assumed)
                continue
        for part in parts(place):
            if part.node in (TRUE, FALSE):
                continue
            if everything and part != right:
                stronger = replace_subformula(formula, part.path, part.extreme)
                if stronger is not FALSE and holds(stronger):
                    subject = to_text(part.node)
                    message = f"`{subject}` does not matter: `{to_text(stronger)}` also holds"
                    yield VacuityFinding("subformula", message, subject, to_text(stronger))
                    continue
            todo.append(part)


def _never(place: Occurrence, stronger: Formula, formula: Formula, assumed: bool) -> VacuityFinding:
    """An implication, the right side of which may be anything."""
    subject, witness = to_text(place.node.args[0]), to_text(stronger)
    if place.node.op == "[]->":
        nothing = f"nothing ever matches `{subject}`{' under the assumptions' if assumed else ''}"
        return VacuityFinding("antecedent", f"{nothing}: `{witness}` also holds", subject, witness)
    everywhere = _is_everywhere(formula, place.path)
    verb = "is never true" if is_boolean(place.node.args[0]) else "never holds"
    where = "in any run" if everywhere else "where it is asked for"
    where += " under the assumptions" if assumed else ""
    return VacuityFinding("antecedent", f"`{subject}` {verb} {where}: `{witness}` also holds", subject, witness)


def _is_everywhere(formula: Formula, path: tuple[int, ...]) -> bool:
    """Whether an occurrence is one in every configuration: it stands below `G` and conjunctions alone."""
    always = False
    for i in path:
        if formula.op not in ("G", "and"):
            return False
        always = always or formula.op == "G"
        formula = formula.args[i]
    return always


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
    if budget.left is not None and budget.left < seconds:
        return Budget(options.limits.within(budget.left))
    return Budget(replace(options.limits, timeout=seconds, whole=None))


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
        keys = shown_atoms(goal.line)
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
            never = tuple(sorted((*never, *self._edges_that_never_hold(goal.line))))
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

    def _edges_that_never_hold(self, line: Property) -> Iterator[str]:
        """Those that letters do not show. Like letters, also in configurations that the assumptions leave out."""
        for key in shown_atoms(line):
            if key not in self._letters:
                never = stronger_line(line, apply("G", negation(atom(key))), line.name)
                if not self._explored.violates(FormulaGoal(never, self._problem.clock), assuming=False):
                    yield key

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
