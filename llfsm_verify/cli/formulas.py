"""The formulas that `llfsm property` works on: from the command line, one per line from a file, or standard input."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from llfsm_verify.automata.ltl.answers import Answers
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.opening import COMMAND_LINE
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.language.atoms import OBSERVATIONS
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.lines import has_header
from llfsm_verify.logic.parsing.definitions import is_definition
from llfsm_verify.logic.parsing.patterns import read_pattern
from llfsm_verify.logic.parsing.tokens import MAX_TOKENS, tokenise
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.properties import Property, named_syntax, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.logic.syntax_names import OURS
from llfsm_verify.logic.syntaxes import parse_in

FLUSH_EVERY = 200
"""Lines of results that are written at once."""


@dataclass(frozen=True, slots=True)
class Line:
    """The columns of a line, separated by tabs, and the syntax of its formulas."""

    columns: tuple[Fragment, ...]
    syntax: str
    property: Property | None = None
    """The property that the line is, in a property file."""

    def formula(self, column: int = 0) -> Formula:
        """The formula in a column, or the one that a pattern there stands for; DiagnosticError when it is neither."""
        text = self.columns[column]
        if self.property is not None:
            if self.property.formula is None:
                message = f"`{self.property.kind} {self.property.name}` is not a formula"
                raise DiagnosticError(Diagnostic(codes.FOREIGN, message, self.property.span))
            return self.property.formula
        tokens = [t for t in tokenise(text.text) if t.type != "NEWLINE"] if self.syntax == OURS else []
        pattern = read_pattern(Words(text, tokens)) if 0 < len(tokens) <= MAX_TOKENS else None
        return parse_in(self.syntax, text).formula if pattern is None else pattern.parsed.formula

    def text(self, column: int = 0) -> str:
        """A column as the user wrote it; of a property file its name as well."""
        if self.property is not None:
            return f"{self.property.name}: {self.property.text}"
        return self.columns[column].text.strip()


def source_of(argument: str) -> Source:
    """What an argument stands for: standard input (`-`), a file's text, or the text itself.

    What can be opened is read: files, pipes, devices. DiagnosticError (E301 and on): it looks like a file's path and
    no such file exists, it is a directory, or the file cannot be read.
    """
    # A formula may be too long for the name of a file: these two then say no.
    if os.path.isdir(argument):  # noqa: PTH112
        hint = "name a file in it" + (f", or write `({argument})` for the atom" if argument.isidentifier() else "")
        raise DiagnosticError(Diagnostic(codes.DIRECTORY, "this is a directory", hint=hint, file=argument))
    if argument == "-" or os.path.exists(argument) or _FILE.fullmatch(argument):  # noqa: PTH110
        return read_source(argument)
    if _MEMBER.fullmatch(argument) and argument.rsplit(".", 1)[1] not in _FIELDS:
        tell(f"note: there is no file `{argument}`, so it is read as an atom")
    return Source(COMMAND_LINE, argument)


_FILE = re.compile(r"\S*\.(?:ltl|tsv|csv|txt|psl|hoa|ya?ml|json)|[\w.~-]*/[\w./~-]*", re.ASCII)
"""What is taken for a file, also where no such file exists: no atom of a formula is called so."""
_OPENING = re.compile(r"(?:\s+|#[^\n]*)*")
"""The blanks and comments before the first formula."""
_MEMBER = re.compile(r"[A-Za-z_]\w*\.[A-Za-z_]\w*", re.ASCII)
_FIELDS = frozenset(OBSERVATIONS)
"""What can be asked of a machine: such a name is no file's."""


def lines_of(source: Source, syntax: str) -> Iterator[Line]:
    """The lines of `source` that are neither empty nor comments; a first comment `# syntax: NAME` counts."""
    whole = Fragment.whole(source)
    opening = _OPENING.match(source.text)
    if source.name != COMMAND_LINE and any(
        has_header(text.lstrip()) or is_definition(text.lstrip(), 0) for text in source.text.split("\n")
    ):
        yield from _properties(source, syntax)
        return
    syntax = named_syntax(whole, tokenise(source.text, opening.end() if opening else 0, limit=0)) or syntax
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


def _properties(source: Source, syntax: str) -> Iterator[Line]:
    """Each property of a property file; DiagnosticError with all its mistakes."""
    for found in parse_properties([source], syntax):
        start, end = found.span.start, found.span.end
        yield Line((Fragment(source.text[start:end], source, range(start, end + 1)),), found.syntax, found)


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
        self.answers = Answers()
        self.count = 0
        """Lines of results so far."""

    def add(self, *columns: str) -> None:
        """A line of columns separated by tabs."""
        self.count += 1
        self._waiting.append("\t".join(columns) + "\n")
        if len(self._waiting) >= FLUSH_EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        text, self._waiting = "".join(self._waiting), []
        if text:
            self._write(text)

    def refuse(self, error: DiagnosticError) -> None:
        """Say what is wrong in a line, on standard error, after the results so far."""
        self.wrong = True
        self.flush()
        tell(*error.diagnostics)

    def give_up(self, line: Line, reason: str, *columns: str) -> None:
        """A line whose answer is not known, because a limit was reached."""
        self.unknown = True
        self.add(*columns)
        self.flush()
        fragment = line.columns[0]
        span = fragment.span(0, len(fragment.text))
        tell(Diagnostic(codes.LIMIT, f"unknown: {reason}", span))
