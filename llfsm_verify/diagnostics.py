"""Places in the user's files and what we have to say about them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path

EXCERPT_WIDTH = 160
"""A shown source line is cut to a window of this many characters around the marked place."""

MOST_NAMES, LIKENESS = 2000, 0.75
"""Files of a folder among which `hint_of_near` seeks one; how similar its name has to be (`difflib`)."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
"""Control characters, line ends among them."""


class Codes(dict[str, str]):
    """Diagnostic codes with their meanings: each is told once, where it gets its name."""

    def add(self, code: str, meaning: str) -> str:
        self[code] = meaning
        return code


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

    def file(self, offset: int) -> str:  # noqa: ARG002 - one file here, but see below
        """What the lines and columns of the character at `offset` count in."""
        return self.name

    def where(self, offset: int) -> str:
        """How the place of the character at `offset` is told."""
        line, column = self.position(offset)
        return f"{self.name}:{line}:{column}"

    def nearby(self, offset: int) -> str:
        """The same for a reader who looks at another place in this source."""
        return f"line {self.position(offset)[0]}"

    def excerpt(self, offset: int) -> str | None:
        """The line of the character at `offset`; None: there is nothing to show."""
        return self.line(self.position(offset)[0])

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {len(self.text)} characters)"


class DataSource(Source):
    """Texts that stand in Python data, as one source: one after another, each with a path in the data as its place.

    A value with parts is a text without characters before those of its parts, so that spans are in order, and within
    each other, as the parts of the data are. Lines and columns count in each text.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name, "")
        self._starts: list[int] = []
        self._pieces: list[tuple[str, str]] = []
        self._length = 0

    def add(self, path: str, text: str = "") -> int:
        """Put another text at the end, and say where it starts. When all are there, `close`."""
        start = self._length
        self._starts.append(start)
        self._pieces.append((path, text))
        self._length += len(text) + 1
        return start

    def close(self) -> None:
        """All texts are there."""
        self.text = "\n".join(text for _, text in self._pieces)

    @property
    def pieces(self) -> tuple[tuple[str, str], ...]:
        """The paths and texts, in order."""
        return tuple(self._pieces)

    def _piece(self, offset: int) -> tuple[str, str, int]:
        """The path and the text of which `offset` is a character, and which of them it is, from 0."""
        from bisect import bisect_right

        number = max(0, bisect_right(self._starts, offset) - 1)
        path, text = self._pieces[number]
        return path, text, min(max(offset - self._starts[number], 0), len(text))

    def position(self, offset: int) -> tuple[int, int]:
        _, text, at = self._piece(offset)
        return text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)

    def file(self, offset: int) -> str:
        return self._piece(offset)[0]

    def where(self, offset: int) -> str:
        path, text, _ = self._piece(offset)
        line, column = self.position(offset)
        return f"{path}:{line}:{column}" if text else path

    def nearby(self, offset: int) -> str:
        return self.file(offset)

    def excerpt(self, offset: int) -> str | None:
        _, text, _ = self._piece(offset)
        return text.split("\n")[self.position(offset)[0] - 1].rstrip("\r") if text else None


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
        """Line and column just after the last character."""
        apart = self.source.file(self.start) != self.source.file(self.end)  # parts of a value in Python data
        return self.source.position(self.start if apart else self.end)

    @property
    def file(self) -> str:
        """The file, or the path in Python data, in which the lines and columns count."""
        return self.source.file(self.start)

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    def __str__(self) -> str:
        return self.source.where(self.start)

    @property
    def nearby(self) -> str:
        """The place for a reader who looks at another one in the same source, such as ``line 3``."""
        return self.source.nearby(self.start)


@dataclass(frozen=True, slots=True)
class Fragment:
    """A piece of a source with the file offset of each of its characters.

    A guard stands inside a YAML scalar: quotes, escapes, folding and indentation come between the two. `offsets` has
    ``len(text) + 1`` entries, the last one being the offset after the fragment.
    """

    text: str
    source: Source
    offsets: tuple[int, ...] | range

    def span(self, start: int, end: int) -> Span:
        """The span in the file of the characters `start` to `end` of this fragment."""
        if not 0 <= start < end <= len(self.text):
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


def counted(number: int, what: str) -> str:
    """``1 step``, ``1,200 steps``: `what` is a noun whose plural only adds an s."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def meant_at(habits: Mapping[str, str], text: str, at: int) -> str | None:
    """The hint of the first of `habits`, patterns with what to write instead of them, that is written around the
    character `at`; groups of the pattern may stand in it."""
    for pattern, hint in habits.items():
        for found in re.compile(pattern, re.MULTILINE).finditer(text, max(0, at - 200), at + 200):
            if found.start() <= at <= found.end():
                return found.expand(hint)
    return None


def hint_of_near(path: str | Path, folder: Path = Path()) -> str | None:
    """A hint that names the file which may have been meant: it is in the same folder and has a similar name, or this
    one with an ending. Its path is told from `folder`, where it lies in that.

    None: there is no such file.
    """
    from difflib import get_close_matches

    missing = Path(path)
    try:
        with os.scandir(missing.parent) as entries:
            names = sorted(entry.name for entry in islice(entries, MOST_NAMES) if entry.is_file())
    except (OSError, ValueError):
        return None
    lowered = {name.lower(): name for name in names}
    near = [lowered[name] for name in get_close_matches(missing.name.lower(), list(lowered), 1, LIKENESS)]
    near += [name for name in names if name.lower().rpartition(".")[0] == missing.name.lower()]
    if not near:
        return None
    meant = missing.with_name(near[0])
    return f"did you mean `{meant.relative_to(folder) if meant.is_relative_to(folder) else meant}`?"


def without_controls(line: str) -> str:
    """The line with what could steer a terminal replaced: messages quote words of the user's files."""
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", line)


def _excerpt(span: Span) -> list[str]:
    shown = span.source.excerpt(span.start)
    if shown is None:
        return []
    number, column, text = span.line, span.column, shown.replace("\t", " ")
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


class Disagreement(Exception):
    """A check of a result failed: the toolkit contradicts itself. The message says what and where."""


class DiagnosticError(Exception):
    """The input is wrong; `diagnostics` says where and how (at least one is an error)."""

    def __init__(self, diagnostics: Iterable[Diagnostic] | Diagnostic) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = (
            (diagnostics,) if isinstance(diagnostics, Diagnostic) else tuple(diagnostics)
        )
        super().__init__("\n".join(d.render() for d in self.diagnostics))


_TELL: ContextVar[tuple[Callable[[str], None] | None, bool]] = ContextVar("tell", default=(None, False))
"""What takes sentences for the user, and whether only warnings are wanted."""


@contextmanager
def telling(call: Callable[[str], None] | None, *, quiet: bool = False) -> Iterator[None]:
    """Within, `tell` calls this. `quiet`: with warnings only."""
    token = _TELL.set((call, quiet))
    try:
        yield
    finally:
        _TELL.reset(token)


def tell(text: str, *, warns: bool = True) -> bool:
    """Tell the user a sentence while the work goes on. False: it is not taken."""
    call, quiet = _TELL.get()
    if call is None or (quiet and not warns):
        return False
    call(text)
    return True
