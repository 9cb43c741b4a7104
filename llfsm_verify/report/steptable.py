"""The table of steps in a terminal: the rows of a trace, or of a run that still goes on, in columns that fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.checking.trace import Trace
from llfsm_verify.report.columns import Column, Layout, lay_out, wrap_items
from llfsm_verify.report.tracetable import MARK, Row, rows

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions

CAUSE = rf"{MARK}[^,]*(?:\([^)]*\)[^,]*)?"
"""An atom that causes the failure, in a line of the table."""
LOOP_MARKS = {"": " ", "first": "┌", "inside": "│", "last": "└", "only": "["}

COLUMNS = (
    Column("step", key=True),
    Column("process", key=True),
    Column("machine", "items", key=True),
    Column("state"),
    Column("fired", "words"),
    Column("inputs", "items", detail=True),
    Column("changes", "items", detail=True),
    Column("property", "items", detail=True),
)


def row_cells(row: Row) -> tuple[str, ...]:
    """A cell a column of COLUMNS."""
    step = LOOP_MARKS[row.mark] + row.step
    return step, row.process, row.machine, row.state, row.fired, row.inputs, row.changes, row.atoms


@dataclass(frozen=True, slots=True)
class StepLines:
    """Writes rows line by line in a layout that is fixed beforehand; `shown` are the columns it has, by index."""

    layout: Layout
    shown: tuple[int, ...]

    @staticmethod
    def fitting(columns: Sequence[Column], shown: Sequence[int], width: int) -> StepLines:
        """The layout for `columns` (all of them, with their measures) in `width` terminal cells."""
        return StepLines(lay_out([columns[i] for i in shown], width), tuple(shown))

    def header(self) -> Text:
        return _line(self.layout.header(), "dim")

    def row(self, row: Row) -> Iterator[Text]:
        style = "dim" if row.folded else "bold red" if row.fired == "FAULT" else ""
        cells = row_cells(row)
        for line in self.layout.lines([cells[i] for i in self.shown]):
            text = _line(line, style)
            text.highlight_regex(CAUSE, "not dim bold red")
            yield text


def _line(text: str, style: str) -> Text:
    return Text(text, style, no_wrap=True, overflow="ignore")


class StepTable:
    """A row a step, the initial configuration first, for rich to print at the width of its console.

    Columns that would be empty are left out.
    """

    def __init__(self, trace: Trace, *, fold: bool = True) -> None:
        self._rows = list(rows(trace, fold=fold))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        columns = list(zip(*map(row_cells, self._rows), strict=True))
        shown = [
            i
            for i, column in enumerate(columns)
            if any(column) and not (COLUMNS[i].title == "process" and len(set(filter(None, column))) == 1)
        ]
        measured = [empty.holding(column) for empty, column in zip(COLUMNS, columns, strict=True)]
        lines = StepLines.fitting(measured, shown, options.max_width)
        yield lines.header()
        for row in self._rows:
            yield from lines.row(row)


@dataclass(frozen=True, slots=True)
class Wrapped:
    """A sentence that is a list, broken after its commas."""

    text: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        first, *more = wrap_items(self.text, max(8, options.max_width - 2))
        yield _line(first, "")
        for line in more:
            yield _line(f"  {line}", "")
