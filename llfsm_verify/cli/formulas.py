"""The formulas that `llfsm property` works on: from the command line, one a line from a file, or standard input."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.properties import named_syntax
from llfsm_verify.logic.reading import read_source
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.logic.tokens import tokenise

FLUSH_EVERY = 200
"""Lines of results that are written at once."""


@dataclass(frozen=True, slots=True)
class Line:
    """The columns of a line, separated by tabs, and the syntax of its formulas."""

    columns: tuple[Fragment, ...]
    syntax: str

    def formula(self, column: int = 0) -> Formula:
        """The formula in a column; DiagnosticError when it is none."""
        return parse_in(self.syntax, self.columns[column]).formula

    def text(self, column: int = 0) -> str:
        """A column as the user wrote it."""
        return self.columns[column].text.strip()


def source_of(argument: str) -> Source:
    """What an argument stands for: standard input (`-`), a file's text, or the text itself.

    DiagnosticError (E301 and on): it looks like a file's path and there is none, or the file cannot be read.
    """
    looks_like_file = argument.endswith((".ltl", ".tsv", ".txt", ".psl")) and not any(c.isspace() for c in argument)
    if argument == "-" or looks_like_file or _is_file(argument):
        return read_source(argument)
    return Source("<command line>", argument)


def _is_file(argument: str) -> bool:
    try:
        return Path(argument).is_file()
    except (OSError, ValueError):
        return False


def lines_of(source: Source, syntax: str) -> Iterator[Line]:
    """The lines of `source` that are neither empty nor comments; a first comment `# syntax: NAME` counts."""
    whole = Fragment.whole(source)
    start_of_text = source.text[:4096]
    head = [t for t in tokenise(start_of_text, limit=2) if t.type != "NEWLINE"]
    syntax = named_syntax(whole, head) or syntax
    start = 0
    for text in source.text.split("\n"):
        end = start + len(text)
        if text.strip() and not text.lstrip().startswith("#"):
            columns = []
            at = start
            for column in text.split("\t"):
                columns.append(Fragment(column, source, range(at, at + len(column) + 1)))
                at += len(column) + 1
            yield Line(tuple(columns), syntax)
        start = end + 1


class Results:
    """Lines of output, and what went wrong on the way: the rest still runs."""

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write = write
        self._waiting: list[str] = []
        self.wrong = False
        """A line could not be read or answered."""
        self.denied = False
        """An equivalence or implication is false."""
        self.unknown = False

    def add(self, *columns: str) -> None:
        """A line of columns separated by tabs."""
        self._waiting.append("\t".join(columns) + "\n")
        if len(self._waiting) >= FLUSH_EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        text, self._waiting = "".join(self._waiting), []
        if text:
            self._write(text)

    def refuse(self, error: DiagnosticError) -> None:
        """Say what is wrong in a line, on standard error, behind the results so far."""
        self.wrong = True
        self.flush()
        for diagnostic in error.diagnostics:
            print(diagnostic.render(), file=sys.stderr)

    def give_up(self, line: Line, reason: str, *columns: str) -> None:
        """A line whose answer is not known, because a limit was reached."""
        self.unknown = True
        self.add(*columns)
        self.flush()
        fragment = line.columns[0]
        span = fragment.span(0, len(fragment.text))
        print(Diagnostic(codes.LIMIT, f"unknown: {reason}", span).render(), file=sys.stderr)
