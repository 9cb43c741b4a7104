"""Reports for people as text and as HTML for notebooks."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING

from llfsm_verify.report.plain import PIPE_WIDTH, plain_text

if TYPE_CHECKING:
    from rich.console import RenderableType

FRAME = '<pre style="line-height:normal;white-space:pre;overflow-x:auto">{code}</pre>'
NOTEBOOK_WIDTH = 160
"""Characters of a line in a notebook, which scrolls."""


def text_of(items: Iterable[RenderableType], width: int | None = None) -> str:
    """The items as plain text, without a newline at the end."""
    return plain_text(items, width or PIPE_WIDTH).rstrip("\n")


def html_of(items: Iterable[RenderableType]) -> str:
    """The items with their colours, as HTML that stands by itself."""
    from rich.console import Console
    from rich.text import Text

    console = Console(
        file=io.StringIO(), record=True, width=NOTEBOOK_WIDTH, force_terminal=True, color_system="truecolor",
        force_jupyter=False, highlight=False, markup=False, emoji=False,
    )  # fmt: skip
    for item in items:
        console.print(item, soft_wrap=isinstance(item, Text))
    return console.export_html(inline_styles=True, code_format=FRAME)
