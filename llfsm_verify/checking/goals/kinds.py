"""The goal of each line of a property file, by its kind; here those of formulas of temporal logic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor, is_invariant
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Letter, ReplayedRun, confirm_bad_prefix
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.formula import FALSE
from llfsm_verify.logic.properties import FEATURES, Feature, Property


def impossible(like: Property, clock: Clock | None) -> FormulaGoal:
    """A goal that every run violates, named as another: its violations are runs that satisfy the assumptions."""
    return FormulaGoal(replace(like, kind="ltl", formula=FALSE, expression=None, file=None, text="false"), clock)


class FormulaGoal:
    """A `name: formula` line."""

    def __init__(self, line: Property, clock: Clock | None = None) -> None:
        """`clock` is needed by formulas with bounds in time."""
        self.line = line
        self.claim = claim_of(line, clock)
        self.atoms = self.claim.atoms

    def monitor(self) -> PrefixMonitor | None:
        """The subset construction of the closure; None when the closure is too large."""
        try:
            return self.claim.monitor()
        except AutomatonTooLarge:
            return None

    def is_safe(self) -> bool:
        return self.claim.is_safety()

    def is_invariant(self) -> bool:
        return is_invariant(self.claim.formula)

    def violations(self) -> Automaton | Lazy:
        return self.claim.automaton(negate=True)

    def confirm_prefix(self, replayed: ReplayedRun, what: str) -> None:
        """No continuation that we try satisfies the formula."""
        confirm_bad_prefix(replayed, self.claim, what)

    def violated_by(self, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
        return not self.claim.true_on(stem, loop)


CHECKED: Final[frozenset[Feature]] = FEATURES
"""What may stand in a property file that is checked, besides plain temporal logic: everything."""


def goals_of(problem: Problem) -> tuple[Goal, ...]:
    """A goal for each line that is checked, in order; DiagnosticError for those that are void (E342, E344)."""
    goals: list[Goal] = []
    mistakes: list[Diagnostic] = []
    for line in problem.properties:
        try:
            goals.append(_goal(line, problem))
        except DiagnosticError as error:
            mistakes += error.diagnostics
    if mistakes:
        raise DiagnosticError(mistakes)
    return tuple(goals)


def _goal(line: Property, problem: Problem) -> Goal:
    if line.expression is not None:
        from llfsm_verify.checking.goals.automata import RegularGoal

        return RegularGoal(line)
    if line.file is not None:
        from llfsm_verify.checking.goals.automata import AutomatonGoal

        return AutomatonGoal(line, problem.automata[line.name])
    return FormulaGoal(line, problem.clock)
