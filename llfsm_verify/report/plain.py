"""What reports print, as a string without colours: for messages that others print."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType

TRAILING = re.compile(r" +$", re.MULTILINE)


def plain_text(items: Iterable[RenderableType], width: int | None = None) -> str:
    """The lines of tables and sentences. `width` in terminal cells: by default that of the terminal, or COLUMNS."""
    from rich.console import Console
    from rich.text import Text

    from llfsm_verify.report.text import PIPE_WIDTH

    cells = width or shutil.get_terminal_size((PIPE_WIDTH, 1)).columns
    file = io.StringIO()
    console = Console(file=file, force_terminal=False, width=cells, highlight=False, markup=False, emoji=False)
    for item in items:
        console.print(item, soft_wrap=isinstance(item, Text))
    return TRAILING.sub("", file.getvalue())
