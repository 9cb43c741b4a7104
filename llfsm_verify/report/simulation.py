"""How a simulated run ended, in a sentence and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.diagnostics import counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Program
from llfsm_verify.report.formats import Style
from llfsm_verify.report.json import trace_object
from llfsm_verify.runtime.stepping.random_run import RandomRun
from llfsm_verify.runtime.stepping.visited import never_visited

OVERFLOW = "A value left 64 bits: the executor cannot go on."


@dataclass(slots=True)
class Simulated:
    """A run that is made while it is reported, and how far it goes."""

    arrangement: Arrangement
    program: Program
    run: RandomRun
    seed: int
    begin: bool
    """Whether it goes on with a saved trace, or begins."""
    held: Mapping[str, str]
    """Inputs that are held at the texts of values."""
    sought: str | None
    steps: int | None
    cycles: int | None
    taken: int = 0
    """Steps so far."""

    def turns(self) -> Iterator[TraceStep]:
        """Its steps, each when it is taken."""
        for step in self.run.steps(self.steps, self.cycles):
            self.taken += 1
            yield step

    def said(self, *, states: bool = True) -> list[str]:
        """How it ended, and (with `states`) which ones were never visited, unless it ended where it was to."""
        from llfsm_verify.report.text import fault_place  # rich

        said = sentences(self.run, self.taken, self.sought)
        said += [] if self.run.fault is None else [fault_place(self.run.fault)]
        return [*said, never_visited(self.run.visits.never)] if states and not self.run.reached else said

    @property
    def exit_code(self) -> int:
        """0; 1 for a fault; 4 for what was not reached, and for a value that left 64 bits."""
        end = ending(self.run)
        if end in ("fault", "overflow"):
            return 1 if end == "fault" else 4
        return 4 if self.sought is not None and end != "reached" else 0


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
        "exit_code": made.exit_code,
    }
    return json.dumps(value, indent=2, ensure_ascii=False)
