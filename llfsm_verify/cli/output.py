"""Standard output: plain text, or rich's tables and colours; a closed pipe is no error."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType

TRAILING = re.compile(r" +(?=(?:\x1b\[[0-9;]*m)*$)", re.MULTILINE)


def usage(message: str) -> int:
    """Say what is wrong with the command line; the exit code for that."""
    print(f"usage: {message}", file=sys.stderr)
    return 2


class Output:
    """Writes to standard output. `colour`: auto (a terminal gets colours unless NO_COLOR is set), always, never."""

    def __init__(self, colour: str = "never") -> None:
        self._colour = colour

    def plain(self, text: str) -> None:
        """Write `text` as it is. When the reader has gone, the rest is dropped: the exit code is still the verdict."""
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def rich(self, items: Iterable[RenderableType]) -> None:
        """Write tables and styled lines; lines that are not in a table are never folded."""
        from rich.console import Console
        from rich.text import Text

        from llfsm_verify.report.text import PIPE_WIDTH

        terminal = {"auto": None, "always": True, "never": False}[self._colour]
        width = None if sys.stdout.isatty() else PIPE_WIDTH
        console = Console(
            file=sys.stdout,
            force_terminal=terminal,
            no_color=True if self._colour == "never" else None,
            width=width,
            highlight=False,
            markup=False,
            emoji=False,
        )
        with console.capture() as capture:
            for item in items:
                console.print(item, soft_wrap=isinstance(item, Text))
        self.plain(TRAILING.sub("", capture.get()))
