"""Runs in which a property that holds does so because something happens: its interesting witnesses.

Source: Beer, Ben-David, Eisner, Rodeh, Efficient detection of vacuity in temporal model checking, FMSD 18 (2001); a
witness is a counterexample to a stronger formula.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace

from llfsm_verify.analysis.vacuity.check import Letters
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.engine import Explored
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, lost_at, shown_atoms
from llfsm_verify.checking.goals.kinds import FormulaGoal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import ReplayedRun
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import PropertyResult, Verdict
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached, check_time, unlimited
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, apply, atom, conjunction, negation
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.logic.rewriting.strengthening import Occurrence, consequent, parts, replace_subformula

MOST = 200
"""Formulas whose counterexample is looked for."""


class Witnesses:
    """Makes witnesses in a space that was explored to its end."""

    def __init__(self, explored: Explored, replayer: Replayer, problem: Problem) -> None:
        self._explored = explored
        self._replayer = replayer
        self._problem = problem
        self._letters = Letters(explored)

    def of(self, result: PropertyResult, goal: Goal) -> PropertyResult:
        """`result` with a witness, if it holds and there is one; else with a note that says why not."""
        if result.verdict is not Verdict.HOLDS:
            return result
        if any(finding.kind == "antecedent" for finding in result.vacuity.findings):
            return mark_unwitnessed(result, "what it speaks of never happens")
        try:
            check_time()
            trace = self._trace(goal)
        except (LimitReached, AutomatonTooLarge, ExpressionTooLarge, Unconfirmed, MemoryError) as limit:
            return mark_unwitnessed(result, str(limit) or "the memory ran out")
        return mark_unwitnessed(result, "there is no run") if trace is None else replace(result, witness=trace)

    def _trace(self, goal: Goal) -> Trace | None:
        """The first run of interest that takes a step, else one that takes none."""
        still: Trace | None = None
        for number, formula in enumerate(self._formulas(goal)):
            if formula in (TRUE, FALSE) or number >= MOST:
                continue
            stronger = replace(goal.line, kind="ltl", formula=formula, expression=None, file=None)
            other = FormulaGoal(stronger, self._problem.clock)
            run = self._explored.find(other)
            if run is not None:
                replayed = self._replayer.violation(other, run, shown_atoms(goal.line))
                _confirm(replayed, goal)
                trace = replace(replayed.trace, witness=True)
                if trace.steps:
                    return trace
                still = still or trace
        return still

    def _formulas(self, goal: Goal) -> Iterator[Formula]:
        """Formulas whose counterexamples are of interest, the most interesting first."""
        if goal.line.formula is not None:
            yield from interesting(goal.line.formula)
            return
        expression = goal.line.expression
        shown = [atom(key) for key in goal.atoms] if expression is None else letters(expression)
        happen = [f for f in shown if f not in self._letters.unmatched(shown)]
        yield negation(conjunction(apply("F", f) for f in happen))
        yield apply("G", FALSE)


def interesting(formula: Formula) -> Iterator[Formula]:
    """Formulas a counterexample of which shows `formula` at work: antecedent and consequent of an implication occur,
    the innermost first; an atom that matters does; or only that `formula` holds."""
    places, todo = list[Occurrence](), deque([Occurrence(formula)])
    while todo and len(places) < MOST:
        places.append(todo.popleft())
        todo.extend(parts(places[-1]))
    for place in reversed(places):
        right = consequent(place)
        if right is not None:
            yield replace_subformula(formula, right.path, negation(right.node))
    for place in places:
        if place.node.op == "atom":
            yield replace_subformula(formula, place.path, place.extreme)
    yield negation(formula)


@unlimited()
def _confirm(replayed: ReplayedRun, goal: Goal) -> None:
    """The run has the property, as far as it goes."""
    start = replayed.loop_letter
    if start is None:
        monitor = goal.monitor()
        wrong = monitor is not None and lost_at(monitor, goal.atoms, replayed.letters) is not None
    else:
        wrong = goal.violated_by(replayed.letters[:start], replayed.letters[start:])
    if wrong:
        raise Disagreement(f"property {goal.line.name}: its witness violates it")


def mark_unwitnessed(result: PropertyResult, why: str) -> PropertyResult:
    """`result` with a note on why it shows no witness."""
    return replace(result, notes=(*result.notes, f"no witness is shown: {why}"))


def add_witnesses(
    explored: Explored, replayer: Replayer, problem: Problem, goals: Sequence[Goal], results: Sequence[PropertyResult]
) -> tuple[PropertyResult, ...]:
    """The results of a check with a witness of each property that holds; the space was explored to its end."""
    makes = Witnesses(explored, replayer, problem)
    return tuple(makes.of(r, g) for r, g in zip(results, goals, strict=True))
