"""How a simulated run ended, in a sentence and as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.diagnostics import counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.json import trace_object

if TYPE_CHECKING:
    from llfsm_verify.runtime.stepping.random_run import RandomRun

OVERFLOW = "A value left 64 bits: the executor cannot go on."


def ending(run: RandomRun) -> str:
    """What ended the run: `reached`, `fault`, `overflow`, `ended`, or `steps`."""
    if run.reached:
        return "reached"
    if run.fault is not None:
        return "fault"
    return "overflow" if run.overflowed else "ended" if run.ended else "steps"


def exit_code(run: RandomRun, sought: str | None) -> int:
    """0; 1 for a fault; 4 for what was not reached, and for a value that left 64 bits."""
    end = ending(run)
    if end in ("fault", "overflow"):
        return 1 if end == "fault" else 4
    return 4 if sought is not None and end != "reached" else 0


def sentences(run: RandomRun, taken: int, sought: str | None) -> list[str]:
    """How it ended, after so many steps; nothing where it was to take so many."""
    first = len(run.before)
    said = []
    if run.reached:
        when = f"after step {first + taken:,}" if first + taken else "in the initial configuration"
        said.append(f"`{sought}` is true {when}.")
    elif sought is not None:
        said.append(
            f"`{sought}` was not true within {counted(taken, 'step')}: another seed, or more steps, may reach it."
        )
    if run.ended:
        said.append(f"The arrangement ended after {counted(first + taken, 'step')}.")
    if run.overflowed:
        said.append(OVERFLOW)
    return said


def summary(steps: int, cycles: int, period_ms: Fraction | None) -> str:
    """How long the run was."""
    time = "" if period_ms is None else f", {float(cycles * period_ms / 1000):g} s of logical time"
    return f"{counted(steps, 'step')}, {counted(cycles, 'cycle')}{time}"


def run_json(
    arrangement: Arrangement,
    run: RandomRun,
    steps: Sequence[TraceStep],
    seed: int,
    sought: str | None,
    period: Fraction | None,
) -> str:
    """The run as one JSON object, schema `simulation`, without a final newline."""
    trace = Trace(run.initial, run.free, (), tuple(steps), None, run.fault, period=period)
    value: dict[str, Json] = {
        "format": FORMAT,
        "arrangement": arrangement.name,
        "path": arrangement.path,
        "seed": seed,
        "until": sought,
        "ending": ending(run),
        "before": len(run.before),
        "trace": trace_object(trace, run.before),
        "never_visited": {machine: list(states) for machine, states in run.visits.never.items()},
        "exit_code": exit_code(run, sought),
    }
    return json.dumps(value, indent=2, ensure_ascii=False)
