"""Monitors of a run: from properties, and what their states mean."""

from __future__ import annotations

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.monitoring.lookup import MonitorTooLarge, WalkTable
from llfsm_verify.monitoring.properties import Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict

WORDS = {MonitorVerdict.TRUE: "satisfied", MonitorVerdict.FALSE: "violated", MonitorVerdict.NOT_YET: "undecided"}
"""What users read of a verdict."""


def monitors_of(problem: Problem) -> tuple[dict[str, Monitor], dict[str, str]]:
    """The monitor of each property, by name, and why others have none. DiagnosticError: a property is void."""
    found: dict[str, Monitor] = {}
    reasons: dict[str, str] = {}
    for goal in goals_of(problem):
        name = goal.line.name
        try:
            timing = Timing(problem.clock)
            found[name] = monitor_properties(goal.line, problem.assumptions, timing).monitor
        except (AutomatonTooLarge, MonitorTooLarge) as limit:
            reasons[name] = str(limit)
        except DiagnosticError as error:
            reasons[name] = error.diagnostics[0].message
    return found, reasons


def decidable(problem: Problem) -> tuple[dict[str, Monitor], dict[str, str]]:
    """The monitors of the properties that a finite part of a run can decide, and why others have none."""
    monitors, reasons = monitors_of(problem)
    for name in [name for name, monitor in monitors.items() if monitor.hopeless[0]]:
        del monitors[name]
        reasons[name] = "no finite part of a run decides it"
    return monitors, reasons


def verdicts_of(monitor: Monitor, table: WalkTable) -> tuple[str, ...]:
    """What each state of the table means, in its own numbers."""
    return tuple(WORDS[monitor.verdicts[state]] for state in table.states)
