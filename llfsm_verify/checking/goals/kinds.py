"""The goal of each line of a property file, by its kind."""

from __future__ import annotations

from typing import Final

from llfsm_verify.checking.goals.formulas import FormulaGoal
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import FEATURES, Feature, Property

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
        from llfsm_verify.checking.goals.regular import RegularGoal

        return RegularGoal(line)
    if line.file is not None:
        from llfsm_verify.checking.goals.automata import AutomatonGoal

        return AutomatonGoal(line, problem.automata[line.name])
    return FormulaGoal(line, problem.clock)
