"""How a simulated run ended, in a sentence and as JSON."""

from __future__ import annotations

import json
from fractions import Fraction

from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.formats import Style
from llfsm_verify.report.json import trace_object
from llfsm_verify.runtime.stepping.random_run import RandomRun, Simulated
from llfsm_verify.runtime.stepping.visited import never_visited

OVERFLOW = "A value left 64 bits: the executor cannot go on."


def said(made: Simulated, *, states: bool = True) -> list[str]:
    """How a run ended, and (with `states`) which ones were never visited, unless it ended where it was to."""
    from llfsm_verify.report.text import fault_place  # rich

    run = made.run
    found = sentences(run, made.taken, made.sought)
    found += [] if run.fault is None else [fault_place(run.fault)]
    return [*found, never_visited(run.visits.never)] if states and not run.reached else found


def exit_code(made: Simulated) -> int:
    """0; 1 for a fault; 4 for what was not reached, and for a value that left 64 bits."""
    end = ending(made.run)
    if end in ("fault", "overflow"):
        return 1 if end == "fault" else 4
    return 4 if made.sought is not None and end != "reached" else 0


def ending(run: RandomRun) -> str:
    """What ended the run: `reached`, `fault`, `overflow`, `ended`, or `steps`."""
    if run.reached:
        return "reached"
    if run.fault is not None:
        return "fault"
    return "overflow" if run.overflowed else "ended" if run.ended else "steps"


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


def report_json(made: Simulated, _: Style) -> str:
    """The run as one JSON object, schema `simulation`, without a final newline."""
    run, steps = made.run, tuple(made.turns())
    trace = Trace(run.initial, run.free, (), steps, None, run.fault, period=made.program.period)
    value: dict[str, Json] = {
        "format": FORMAT,
        "arrangement": made.arrangement.name,
        "path": made.arrangement.path,
        "seed": made.seed,
        "until": made.sought,
        "ending": ending(run),
        "before": len(run.before),
        "trace": trace_object(trace, run.before),
        "never_visited": {machine: list(states) for machine, states in run.visits.never.items()},
        "exit_code": exit_code(made),
    }
    return json.dumps(value, indent=2, ensure_ascii=False)
