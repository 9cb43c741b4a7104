"""The table of steps in a terminal: the rows of a trace, or of a run that still goes on, in columns that fit."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.checking.trace import Trace
from llfsm_verify.report.columns import Column, Layout, lay_out
from llfsm_verify.report.tracetable import MARK, Row, rows

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions

CAUSE = rf"{MARK}[^,]*(?:\([^)]*\)[^,]*)?"
"""An atom that causes the failure, in a line of the table."""
LOOP_MARKS = {"": " ", "first": "┌", "inside": "│", "last": "└", "only": "["}
RULE = "─"
WIDEST = 100
"""Cells of a rule and of a list of values, at most."""

COLUMNS = (
    Column("step", key=True),
    Column("cycle", key=True),
    Column("time", key=True),
    Column("process", key=True),
    Column("machine", "items", key=True),
    Column("state"),
    Column("fired", "words"),
    Column("inputs", "items", detail=True),
    Column("changes", "items", detail=True),
    Column("property", "items", detail=True),
)
CYCLE, PROCESS = 1, 3


def row_cells(row: Row) -> tuple[str, ...]:
    """A cell a column of COLUMNS."""
    step = LOOP_MARKS[row.mark] + row.step
    when = (step, row.cycle, row.time)
    return *when, row.process, row.machine, row.state, row.fired, row.inputs, row.changes, row.atoms


@dataclass(frozen=True, slots=True)
class StepLines:
    """Writes rows line by line in a layout that is fixed beforehand; `shown` are the columns it has, by index."""

    layout: Layout
    shown: tuple[int, ...]

    @staticmethod
    def fitting(columns: Sequence[Column], shown: Sequence[int], width: int) -> StepLines:
        """The layout for `columns` (all of them, with their measures) in `width` terminal cells."""
        return StepLines(lay_out([columns[i] for i in shown], width), tuple(shown))

    @staticmethod
    def of(rows: Sequence[Row], left_out: Collection[int], width: int) -> StepLines:
        """The layout for rows, without empty columns and those that are left out."""
        columns = list(zip(*map(row_cells, rows), strict=True))
        shown = [i for i, column in enumerate(columns) if any(column) and i not in left_out]
        measured = [empty.holding(column) for empty, column in zip(COLUMNS, columns, strict=True)]
        return StepLines.fitting(measured, shown, width)

    def header(self) -> Text:
        return _line(self.layout.header(), "dim")

    def rule(self) -> Text:
        """The line between two cycles."""
        return _line(RULE * min(len(self.layout.header()), WIDEST), "dim")

    def row(self, row: Row) -> Iterator[Text]:
        """The row; colour only repeats what its words and signs say."""
        fires = row.fired.startswith("→")
        style = "dim" if row.folded else "bold red" if row.fired == "FAULT" else "bold" if fires else ""
        cells = row_cells(row)
        for line in self.layout.lines([cells[i] for i in self.shown]):
            text = _line(line, style)
            text.highlight_regex(CAUSE, "not dim bold red")
            yield text


def _line(text: str, style: str) -> Text:
    return Text(text, style, no_wrap=True, overflow="ignore")


class StepTable:
    """A row a step, the initial configuration first, for rich to print at the width of its console.

    Columns that would be empty are left out. A thin rule stands between cycles of several rows.
    """

    def __init__(self, trace: Trace, *, fold: bool = True) -> None:
        self._rows = list(rows(trace, fold=fold))
        self._whole = len(trace.steps) > 1 and all(step.cycle or step.process is None for step in trace.steps)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        several = len({row.process for row in self._rows} - {""}) > 1
        left_out = {CYCLE} if self._whole else set[int]()  # each step is one
        lines = StepLines.of(self._rows, left_out if several else {PROCESS, *left_out}, options.max_width)
        yield lines.header()
        sizes = self._sizes()
        for number, row in enumerate(self._rows):
            if number > 1 and row.begins and not several and max(sizes[number - 1], sizes[number]) > 1:
                yield lines.rule()
            yield from lines.row(row)

    def _sizes(self) -> list[int]:
        """How many rows the cycle of each row has."""
        starts = [i for i, row in enumerate(self._rows) if i <= 1 or row.begins]
        ends = [*starts[1:], len(self._rows)]
        return [end - start for start, end in zip(starts, ends, strict=True) for _ in range(start, end)]


@dataclass(frozen=True, slots=True)
class Listed:
    """The values of a configuration: a sentence where they fit into a line, else a list in columns."""

    title: str
    pairs: tuple[tuple[str, str], ...]

    INDENT = 2
    GAP = 3

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        items = [f"{name} = {text}" for name, text in self.pairs]
        width = min(options.max_width, WIDEST)
        line = f"{self.title} {', '.join(items)}."
        if len(line) <= width:
            yield _line(line, "")
            return
        yield _line(f"{self.title}:", "")
        for parts in self._lines(items, width - self.INDENT):
            yield _line(f"{' ' * self.INDENT}{parts}", "")

    def _lines(self, items: Sequence[str], width: int) -> Iterator[str]:
        """As many columns as fit, read from top to bottom, as `ls` lists files."""
        for count in range(len(items), 0, -1):
            height = -(-len(items) // count)
            columns = [items[i : i + height] for i in range(0, len(items), height)]
            widths = [max(map(len, column)) for column in columns]
            if count == 1 or sum(widths) + self.GAP * (len(widths) - 1) <= width:
                break
        for line in range(height):
            cells = [(column[line], size) for column, size in zip(columns, widths, strict=True) if line < len(column)]
            yield (" " * self.GAP).join(cell.ljust(size) for cell, size in cells).rstrip()
