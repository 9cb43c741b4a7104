"""Places in the user's files and what we have to say about them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

EXCERPT_WIDTH = 160
"""A shown source line is cut to a window of this many characters around the marked place."""


_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Control characters, line ends among them."""


class Source:
    """One text the user gave us: `name` as we show it (a path, or ``<stdin>``) and its whole `text`."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.text = text

    @cached_property
    def _line_starts(self) -> list[int]:
        starts = [0]
        for i, c in enumerate(self.text):
            if c == "\n":
                starts.append(i + 1)
        return starts

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column, both counted from 1, of the character at `offset`."""
        from bisect import bisect_right

        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """The text of line `number` (from 1), without its end."""
        starts = self._line_starts
        end = starts[number] if number < len(starts) else len(self.text)
        return self.text[starts[number - 1] : end].rstrip("\r\n")

    def __repr__(self) -> str:
        return f"Source({self.name!r}, {len(self.text)} characters)"


@dataclass(frozen=True, slots=True)
class Span:
    """The characters `start` to `end` (end not included) of `source`."""

    source: Source = field(repr=False)
    start: int
    end: int

    @property
    def line(self) -> int:
        return self.source.position(self.start)[0]

    @property
    def column(self) -> int:
        return self.source.position(self.start)[1]

    @property
    def end_position(self) -> tuple[int, int]:
        """Line and column just behind the last character."""
        return self.source.position(self.end)

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    def __str__(self) -> str:
        return f"{self.source.name}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Fragment:
    """A piece of a source with the file offset of each of its characters.

    A guard stands inside a YAML scalar: quotes, escapes, folding and indentation come between the two. `offsets` has
    ``len(text) + 1`` entries, the last one being the offset behind the fragment.
    """

    text: str
    source: Source
    offsets: tuple[int, ...] | range

    def span(self, start: int, end: int) -> Span:
        """The span in the file of the characters `start` to `end` of this fragment."""
        start = max(0, min(start, len(self.text)))
        end = max(start, min(end, len(self.text)))
        first = self.offsets[start]
        last = self.offsets[end - 1] + 1 if end > start else first
        return Span(self.source, first, max(first, last))

    @staticmethod
    def whole(source: Source) -> Fragment:
        return Fragment(source.text, source, range(len(source.text) + 1))


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing to tell the user: a stable `code` (``E…`` error, ``W…`` warning), what is wrong, where, what to do."""

    code: str
    message: str
    span: Span | None = None
    notes: tuple[str, ...] = ()
    hint: str | None = None
    file: str | None = None
    """The file it is about when there is no place in it to show (unreadable, not text)."""

    @property
    def is_error(self) -> bool:
        return self.code.startswith("E")

    def render(self, kind: str | None = None) -> str:
        """The diagnostic as plain text: place, message, the line with the place marked, notes and hint.

        `kind` stands for the word before the code (by default it follows from the code).
        """
        kind = kind or ("error" if self.is_error else "warning")
        where = str(self.span) if self.span else self.file
        lines = [f"{where}: {kind}[{self.code}]: {self.message}" if where else f"{kind}[{self.code}]: {self.message}"]
        if self.span is not None:
            lines += _excerpt(self.span)
        lines += [f"  note: {note}" for note in self.notes]
        if self.hint is not None:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(map(without_controls, lines))


def without_controls(line: str) -> str:
    """The line with what could steer a terminal replaced: messages quote words of the user's files."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", line)


def _excerpt(span: Span) -> list[str]:
    number, column = span.line, span.column
    text = span.source.line(number).replace("\t", " ")
    width = max(1, min(span.end - span.start, len(text) - column + 1))
    shift = 0
    if len(text) > EXCERPT_WIDTH:
        shift = max(0, min(column - EXCERPT_WIDTH // 2, len(text) - EXCERPT_WIDTH))
        width = min(width, max(1, shift + EXCERPT_WIDTH - column + 1))
        text = (
            ("…" if shift else "") + text[shift : shift + EXCERPT_WIDTH] + ("…" * (shift + EXCERPT_WIDTH < len(text)))
        )
        shift -= 1 if shift else 0
    text = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    gutter = f"{number:>5} | "
    mark = " " * (column - 1 - shift) + "^" * width
    return [gutter + text, " " * (len(gutter) - 2) + "| " + mark]


class DiagnosticError(Exception):
    """The input is wrong; `diagnostics` says where and how (at least one is an error)."""

    def __init__(self, diagnostics: Iterable[Diagnostic] | Diagnostic) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = (
            (diagnostics,) if isinstance(diagnostics, Diagnostic) else tuple(diagnostics)
        )
        super().__init__("\n".join(d.render() for d in self.diagnostics))
