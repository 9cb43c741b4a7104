"""What a debugger answers, as lines for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.text import Text

from llfsm_verify.diagnostics import counted
from llfsm_verify.report.columns import Column, lay_out
from llfsm_verify.report.steptable import PROCESS, StepLines
from llfsm_verify.report.tracetable import step_row
from llfsm_verify.runtime.debugging.commands import Part, Steps, Table

BROKEN = frozenset({"because", "changes", "what it does", "formula", "guard"})
"""Columns whose cells may go on in the next line."""


def part_lines(part: Part, width: int) -> Iterator[Text]:
    """The lines of one part of an answer in so many terminal cells."""
    if isinstance(part, str):
        yield Text(part)
    elif isinstance(part, Steps):
        yield from _steps(part, width)
    else:
        yield from table_lines(part, width)


def lines_of(parts: Iterable[Part], width: int) -> Iterator[Text]:
    """The lines of an answer."""
    for part in parts:
        yield from part_lines(part, width)


def table_lines(table: Table, width: int) -> Iterator[Text]:
    """A table in columns that fit; columns without a cell are left out."""
    columns = list(zip(*table.rows, strict=True)) if table.rows else []
    shown = [i for i, cells in enumerate(columns) if any(cells)]
    measured = [
        Column(table.columns[i], "words" if table.columns[i] in BROKEN else "never", key=not n).holding(columns[i])
        for n, i in enumerate(shown)
    ]
    layout = lay_out(measured, width)
    yield Text(layout.header(), "dim")
    for row in table.rows:
        for line in layout.lines([row[i] for i in shown]):
            yield Text(line)


def _steps(part: Steps, width: int) -> Iterator[Text]:
    if part.left_out:
        yield Text(f"{counted(part.left_out, 'step')} before these are not shown", "dim")
    rows = [step_row(number, step) for number, step in enumerate(part.steps, part.first)]
    if not rows:
        return
    several = len({step.process for step in part.steps}) > 1
    lines = StepLines.of(rows, () if several else (PROCESS,), width)
    yield lines.header()
    for row in rows:
        yield from lines.row(row)
