"""Standard output: plain text, or rich's tables and colours; a closed pipe is no error. And what is told beside it."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType


def drop_output() -> None:
    """Send the rest of standard output nowhere, so that what is still buffered does not fail again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def tell(*what: str | Diagnostic) -> None:
    """Say this on standard error, one after the other."""
    for each in what:
        print(each if isinstance(each, str) else each.render(), file=sys.stderr, flush=True)


class Output:
    """Writes to standard output. `colour`: auto (a terminal gets colours unless NO_COLOR is set), always, never.
    `width`: terminal cells of a line, if that is not what the terminal has.

    `closed` says that the reader has gone: there is no use in going on for the sake of what is printed.
    """

    def __init__(self, colour: str = "never", width: int | None = None) -> None:
        self._colour = colour
        self._width = width
        self.closed = False

    def plain(self, text: str) -> None:
        """Write `text` as it is. When the reader has gone, the rest is dropped: the exit code is still the verdict.

        Raises DiagnosticError (E412) when standard output cannot be written, such as on a full disk.
        """
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except BrokenPipeError:
            self.closed = True
            drop_output()
        except OSError as error:
            drop_output()
            message = f"the result cannot be written: {error.strerror or 'input/output error'}"
            raise DiagnosticError(Diagnostic("E412", message, file="<stdout>")) from None

    def rich(self, items: Iterable[RenderableType]) -> None:
        """Write tables and styled lines; plain lines are never folded."""
        from llfsm_verify.report.plain import captured

        self.plain(captured(self._console, items))

    def write(self, report: str | Iterable[RenderableType]) -> None:
        """Write a report: text as it is, with a final newline, or what a terminal shows."""
        if isinstance(report, str):
            self.plain(report + "\n")
        else:
            self.rich(report)

    def stream(self, items: Iterable[RenderableType]) -> None:
        """Write each when it is there, until the reader has gone."""
        for item in items:
            self.rich([item])
            if self.closed:
                return

    @property
    def width(self) -> int:
        """Terminal cells of a line: of the terminal, or COLUMNS; PIPE_WIDTH where there is neither."""
        return self._console.width

    @cached_property
    def _console(self) -> Console:
        from rich.console import Console

        from llfsm_verify.report.plain import PIPE_WIDTH

        terminal = sys.stdout.isatty()
        known = terminal or os.environ.get("COLUMNS", "").strip("0").isdigit()
        return Console(
            file=io.StringIO(),
            force_terminal={"auto": terminal, "always": True, "never": False}[self._colour],
            no_color=True if self._colour == "never" else None,
            width=self._width or (None if known else PIPE_WIDTH),
            highlight=False,
            markup=False,
            emoji=False,
        )
