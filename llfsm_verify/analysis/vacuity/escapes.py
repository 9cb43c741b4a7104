"""Assumptions that the arrangement escapes: what comes after does not count, whatever property holds."""

from __future__ import annotations

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.engine import Explored
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.vacuity import Escape, VacuityFinding
from llfsm_verify.checking.world import are_about_world
from llfsm_verify.limits import Budget, LimitReached

LEAST = 2.0
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
    """What is known where nobody can look; `why`."""
    return Escape() if are_about_world(problem) else Escape(reason=f"{NOT_LOOKED}: {why}")


def escape_finding(problem: Problem, trace: Trace) -> VacuityFinding:
    """What an escape says of everything that holds."""
    steps = len(trace.steps)
    where = f"after step {steps} of a run" if steps else "from an initial configuration"
    message = f"{where} no continuation meets the assumptions, so what happens then does not count"
    return VacuityFinding("escape", message, ", ".join(p.name for p in problem.assumptions))
