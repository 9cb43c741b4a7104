"""The table of a run that still goes on: a row is written when its step is done, in columns that are fixed before."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from textwrap import wrap

from rich.text import Text

from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.program.program import Choice, FaultSite, Int, Program
from llfsm_verify.report.columns import Column
from llfsm_verify.report.cycles import Cycles, Times
from llfsm_verify.report.formats import Style
from llfsm_verify.report.simulation import said
from llfsm_verify.report.steptable import COLUMNS, StepLines
from llfsm_verify.report.tracetable import LastShown, Row, step_row
from llfsm_verify.report.wording import event_text
from llfsm_verify.runtime.stepping.random_run import Simulated
from llfsm_verify.runtime.stepping.visited import never_visited
from llfsm_verify.values import value_text

WIDE_VALUE = 16
WIDE_INPUTS = 80
"""Longer values, and lists of inputs, get no room of their own: they wrap."""
INITIALLY, GOES_ON = "initially", "as the trace ends"
"""What is said of where a run begins."""


class RunTable:
    """Writes a run of `program` in `width` terminal cells. `initial` has its variables at the begin, `held` the inputs
    that have a value throughout; `first` is the number of the step after which it begins (None: it does not go on with
    another run), `last` that of the last step, as far as that is known."""

    def __init__(
        self,
        program: Program,
        initial: tuple[tuple[str, str], ...],
        held: Mapping[str, str],
        first: int | None,
        last: int,
        width: int,
    ) -> None:
        self._first = first or 0
        self._beginning = INITIALLY if first is None else GOES_ON
        self._free = _free(program, dict(initial))
        columns = _columns(program, initial, held, last, self._beginning)
        self._lines = StepLines.fitting(columns, [i for i, column in enumerate(columns) if column.natural], width)
        self._times = Times.until(program.period, last)
        self._shown = LastShown(dict(initial))
        self._ruled = len(program.slots) > 1 and len(program.processes) == 1
        self._begun = False

    def head(self) -> Iterator[Text]:
        """The titles, and the row of where the run begins."""
        yield self._lines.header()
        yield from self._lines.row(Row("", str(self._first), "", "", "", self._beginning, self._free, "", ""))

    def step(self, number: int, step: TraceStep, cycles: Cycles, *, faulted: bool) -> Iterator[Text]:
        """The row of a step, after a thin rule where a cycle of several steps ends."""
        moment = cycles.moment(step)
        row = step_row(number, self._shown.fresh(step), faulted=faulted)
        if moment.begins:
            row = replace(row, cycle=str(moment.cycle), time=self._times.of(moment.cycle, moment.cycle))
            if self._ruled and self._begun:
                yield self._lines.rule()
        self._begun = True
        yield from self._lines.row(row)


def report(made: Simulated, style: Style) -> Iterator[Text]:
    """The table of a run, each step as soon as it is taken, and how the run ended."""
    first, cycles = len(made.run.before), Cycles()
    for step in made.run.before:
        cycles.moment(step)
    last = first + (made.steps or (made.cycles or 1) * len(made.program.slots))
    begin = first if made.begin else None
    table = RunTable(made.program, made.run.initial, made.held, begin, last, style.width)
    yield from table.head()
    told: set[FaultSite] = set()
    for number, step in enumerate(made.turns(), first + 1):
        yield from table.step(number, step, cycles, faulted=made.run.fault is not None)
        for event in step.events:
            if event.site not in told:
                told.add(event.site)
                yield Text(f"I{event_text(number, step, event)[1:]}.")
    yield from map(Text, said(made, states=False))
    if not made.run.reached:
        never = never_visited(made.run.visits.never)
        yield from map(Text, wrap(never, style.width, subsequent_indent="  "))


def _columns(
    program: Program, initial: tuple[tuple[str, str], ...], held: Mapping[str, str], last: int, beginning: str
) -> list[Column]:
    """The columns with room for whatever a run can show, as far as that is known before it runs.

    Those that stay empty have a natural width of 0. How many variables a step changes is not known: their column is the
    last one, has room for one change, and wraps.
    """
    machines = program.machines
    fired = [f"→ {m.states[t.target]} when {t.text}" for m in machines for ts in m.transitions for t in ts]
    inputs = [*_widest_inputs(program, held), *filter(None, [_free(program, dict(initial))])]
    value = _wide_value(program)
    cells: dict[str, list[str]] = {
        "step": [f" {last}"],
        "cycle": [str(last)] if len(program.slots) > 1 else [],
        "time": [Times.until(program.period, last).of(last, last)],
        "process": [process.name for process in program.processes] if len(program.processes) > 1 else [],
        "machine": [m.name for m in machines],
        "state": [name for m in machines for name in m.states],
        "fired": [*fired, beginning],
        "inputs": [", ".join(inputs)] if sum(map(len, inputs)) < WIDE_INPUTS else [f"{text}," for text in inputs],
        "changes": [f"{name}: {value} → {value}" for name, _ in initial],
        "property": [],
    }
    return [column.holding(cells[column.title]) if any(cells[column.title]) else column for column in COLUMNS]


def _wide_value(program: Program) -> str:
    """As wide as the values of most variables."""
    values = [text for var in program.vars for text in (*var.origin.labels, *_bounds(var.type))]
    return "x" * min(max(map(len, values), default=0), WIDE_VALUE)


def _free(program: Program, initial: Mapping[str, str]) -> str:
    """The inputs that got a value before the run, which they keep."""
    return ", ".join(f"{v.name} = {initial[v.name]}" for v in program.vars if v.free)


def _widest_inputs(program: Program, held: Mapping[str, str]) -> list[str]:
    choices = {choice.source: choice for choice in program.choices}
    return [f"{name} = {held.get(name) or _widest(choice)}" for name, choice in choices.items()]


def _widest(choice: Choice) -> str:
    low, high = choice.type.low, choice.type.high
    values = range(low, low + len(choice.labels)) if choice.labels else (low, high)
    return max((value_text(choice.type, choice.labels, value) for value in values), key=len)


def _bounds(kind: object) -> tuple[str, str]:
    if isinstance(kind, Int):
        return value_text(kind, (), kind.low), value_text(kind, (), kind.high)
    return "", ""
