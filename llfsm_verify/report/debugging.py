"""What a debugger answers, as data and as lines for a terminal, and the fronts that show it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from rich.text import Text

from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.diagnostics import counted
from llfsm_verify.registry import Registry
from llfsm_verify.report.columns import Column, lay_out
from llfsm_verify.report.steptable import PROCESS, StepLines
from llfsm_verify.report.tracetable import step_row

BROKEN = frozenset({"because", "changes", "what it does", "formula", "guard"})
"""Columns whose cells may go on in the next line."""


class DebugError(Exception):
    """A command cannot be done; the debugger stays where it was. The message says why, and what can be done."""


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps as traces show them, `first` being the number of the first one; so many were `left_out` before it."""

    first: int
    steps: tuple[TraceStep, ...]
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class Table:
    """Cells below the titles of their columns."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


Part = str | Steps | Table


@dataclass(frozen=True, slots=True)
class Answer:
    """What a command came to. `expected`: whether what `expect` asked for is so (None: nothing was asked)."""

    parts: tuple[Part, ...] = ()
    expected: bool | None = None
    quits: bool = False


class Session(Protocol):
    """A debugger with its commands, as a front sees it."""

    def do(self, line: str) -> Answer:
        """Do a command. DebugError: it cannot be done, and nothing has changed, or it stopped on its way."""

    def where(self) -> str:
        """One line: the position, its time, and the states of all machines."""

    def stop(self) -> None:
        """End the command that another thread is doing, as soon as it can."""


FRONT_ENDS: Registry[Callable[[Session], int]] = Registry("front end of the debugger", (), "llfsm_verify.debuggers")
"""Each shows a session on a terminal until its user ends it; the exit code. The first is asked."""


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
