"""Columns of text that fit a width: which cells wrap and where, which go below their row, so that no name is cut."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from rich.cells import cell_len, chop_cells

GAP = 2
"""Blanks between two columns."""

WORDS_WIDTH = 24
"""A text of words is not squeezed into less."""

Breaks = Literal["never", "items", "words"]
_ITEMS = re.compile(r"(?<=,) ")


@dataclass(frozen=True, slots=True)
class Column:
    """A column before its width is known, all measures in terminal cells.

    `breaks` says where a cell may go on in the next line: nowhere, after a comma, or between words. `natural` is the
    width of its widest cell, `least` of the widest piece that stays in one line; titles count as cells. A `detail` may
    be written below its row instead. `key` columns stand in the row however narrow it is.
    """

    title: str
    breaks: Breaks = "never"
    natural: int = 0
    least: int = 0
    detail: bool = False
    key: bool = False

    def holding(self, cells: Sequence[str]) -> Column:
        """The same column with room for these cells."""
        natural, least = self.natural, self.least
        for cell in (self.title, *cells):
            natural = max(natural, cell_len(cell))
            least = max(least, *(cell_len(piece) for piece in _pieces(cell, self.breaks)))
        return replace(self, natural=natural, least=least)


@dataclass(frozen=True, slots=True)
class Layout:
    """How rows are written: `widths` of the columns that stand side by side (by index), `below` the others."""

    columns: tuple[Column, ...]
    widths: tuple[tuple[int, int], ...]
    below: tuple[int, ...]
    width: int

    def header(self) -> str:
        return self._line([self.columns[i].title for i, _ in self.widths])

    def lines(self, cells: Sequence[str]) -> Iterator[str]:
        """The row of `cells` (one a column): its lines side by side, then what goes below it, with its title."""
        wrapped = [wrap(cells[i], self.columns[i].breaks, width) for i, width in self.widths]
        for number in range(max(map(len, wrapped))):
            yield self._line([lines[number] if number < len(lines) else "" for lines in wrapped])
        indent = " " * (self.widths[0][1] + GAP)
        yield from (f"{indent}{line}" for line in self._below(cells, max(8, self.width - len(indent) - 2)))

    def _below(self, cells: Sequence[str], room: int) -> Iterator[str]:
        """What goes below a row: texts that fit side by side into a line share it."""
        line = ""
        for column, cell in ((self.columns[i], cells[i]) for i in self.below if cells[i]):
            first, *more = wrap(f"{column.title}: {cell}", column.breaks, room)
            joined = f"{line}{' ' * GAP}{first}"
            if line and not more and cell_len(joined) <= room:
                line = joined
                continue
            if line:
                yield line
            line = "" if more else first
            if more:
                yield first
                yield from (f"  {each}" for each in more)
        if line:
            yield line

    def _line(self, cells: Sequence[str]) -> str:
        padded = (cell + " " * (width - cell_len(cell)) for cell, (_, width) in zip(cells, self.widths, strict=True))
        return (" " * GAP).join(padded).rstrip()


def lay_out(columns: Sequence[Column], width: int) -> Layout:
    """The first of these that fits into `width` cells: all columns side by side, with lists wrapped after commas;
    details below the rows, with texts wrapped between words; everything but the keys below the rows."""
    everything = range(len(columns))
    head = [i for i in everything if not columns[i].detail]
    keys = [i for i in everything if columns[i].key]
    tries: list[tuple[Sequence[int], tuple[Breaks, ...]]] = [(everything, ("items",)), (head, ("items", "words"))]
    for shown, squeezed in tries:
        widths = _fitting([columns[i] for i in shown], width, squeezed)
        if widths is not None:
            break
    else:
        shown, widths = keys, _forced([columns[i] for i in keys], width)
    below = tuple(i for i in everything if i not in shown)
    return Layout(tuple(columns), tuple(zip(shown, widths, strict=True)), below, width)


def _fitting(columns: Sequence[Column], width: int, squeezed: Sequence[Breaks]) -> list[int] | None:
    """Widths of which none is below what its column needs; None when that is more than there is."""
    widths = [_needs(column) if column.breaks in squeezed else column.natural for column in columns]
    spare = width - sum(widths) - GAP * (len(columns) - 1)
    if spare < 0:
        return None
    wanted = sorted((column.natural - widths[i], i) for i, column in enumerate(columns))
    for number, (want, i) in enumerate(wanted):
        given = min(want, spare // (len(wanted) - number))
        widths[i] += given
        spare -= given
    widths[-1] += spare  # nothing comes after it, and a cell may turn out wider than was foreseen
    return widths


def _needs(column: Column) -> int:
    return max(column.least, min(column.natural, WORDS_WIDTH)) if column.breaks == "words" else column.least


def _forced(columns: Sequence[Column], width: int) -> list[int]:
    """Every column as it is but the last one, which has what is left: names longer than that are folded."""
    widths = [column.natural for column in columns]
    left = width - sum(widths[:-1]) - GAP * (len(columns) - 1)
    return [*widths[:-1], max(8, min(widths[-1], left))]


def _pieces(text: str, breaks: Breaks) -> list[str]:
    return [text] if breaks == "never" else _ITEMS.split(text) if breaks == "items" else text.split(" ")


def wrap(text: str, breaks: Breaks, width: int) -> list[str]:
    """As many pieces a line as fit; a piece longer than a line is folded where the line ends."""
    lines: list[str] = []
    line = ""
    for piece in _pieces(text, breaks):
        joined = f"{line} {piece}" if line else piece
        if cell_len(joined) <= width:
            line = joined
            continue
        if line:
            lines.append(line)
        *folded, line = [piece] if cell_len(piece) <= width else chop_cells(piece, width)
        lines += folded
    return [*lines, line]
