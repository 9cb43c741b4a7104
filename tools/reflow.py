"""Wraps the prose of Markdown at 120 columns: `python -m tools.reflow CHANGELOG.md`.

Only paragraphs and items that have a longer line are wrapped again. Blocks, tables, headings and what benchmarks write
into a page stay as they are, and so does every word.
"""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

WIDTH = 120
ITEM = re.compile(r" *(?:[-*+] |\d+\. )?")
FENCE = re.compile(r" *```|<!-- (?:written by|end of) ")
SPAN = re.compile(r"`[^`]*`")
STAYS = re.compile(r"$|[|#<]|    (?! *[-*+] )")
"""How a line begins that is not prose: nothing, a table, a heading, HTML, or an indented block."""
MARKED = re.compile(r" *(?:[-*+] |[>|<]|#+ |\d+[.)] )|" + FENCE.pattern)
"""How a line must not begin that was in the middle of a sentence."""


def reflow(text: str, width: int = WIDTH) -> str:
    """The same words, wrapped where a line was too long."""
    lines: list[str] = []
    for piece in _pieces(text.split("\n")):
        prose = not FENCE.match(piece[0]) and not STAYS.match(piece[0])
        lines += _wrapped(piece, width) if prose and any(_too_long(line, width) for line in piece) else piece
    return "\n".join(lines)


def _too_long(line: str, width: int) -> bool:
    """Whether it could be shorter: a long word or piece of code alone on its line could not."""
    return len(line) > width and " " in SPAN.sub("", line).strip()


def _pieces(lines: list[str]) -> Iterator[list[str]]:
    """Blocks, paragraphs and items, each with all of its lines; other lines one by one."""
    start = 0
    while start < len(lines):
        end = start + 1
        if FENCE.match(lines[start]):
            while end < len(lines) and not FENCE.match(lines[end]):
                end += 1
            end += 1
        elif not STAYS.match(lines[start]):
            while end < len(lines) and lines[end].strip() and not MARKED.match(lines[end]):
                end += 1
        yield lines[start:end]
        start = end


def _wrapped(lines: list[str], width: int) -> list[str]:
    """A paragraph or an item; somewhat narrower if a line would begin like an item or a heading."""
    first = ITEM.match(lines[0])
    assert first
    words = " ".join(line.strip() for line in [lines[0][first.end() :], *lines[1:]])
    for most in range(width, width // 2, -1):
        found = textwrap.wrap(
            words, most, initial_indent=first[0], subsequent_indent=" " * first.end(),
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
        if not any(MARKED.match(line) for line in found[1:]):
            return found
    return lines


def main(paths: list[str]) -> None:
    for path in map(Path, paths):
        path.write_text(reflow(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
