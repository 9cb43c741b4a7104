"""Tables and styled lines as one string, for those who print it themselves."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

PIPE_WIDTH = 400
"""Columns when the output is no terminal: a table in a file is cut only beyond this."""

_TRAILING = re.compile(r" +(?=(?:\x1b\[[0-9;]*m)*$)", re.MULTILINE)


def captured(console: Console, items: Iterable[RenderableType]) -> str:
    """What `console` would print; plain lines are never folded, and no line ends in blanks."""
    from rich.text import Text

    with console.capture() as captured:
        for item in items:
            console.print(item, soft_wrap=isinstance(item, Text))
    return _TRAILING.sub("", captured.get())


def plain_text(items: Iterable[RenderableType], width: int | None = None) -> str:
    """The items one below the other, without colours, in `width` terminal cells (else those of the terminal, COLUMNS or
    PIPE_WIDTH)."""
    from rich.console import Console

    width = width or shutil.get_terminal_size((PIPE_WIDTH, 1)).columns
    plain = {"force_terminal": False, "no_color": True, "highlight": False, "markup": False, "emoji": False}
    return captured(Console(file=io.StringIO(), width=width, **plain), items)  # type: ignore[arg-type]
