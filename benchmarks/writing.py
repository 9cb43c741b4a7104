"""Tables that benchmarks write into a page, between two marks, with the day, the versions and the computer below."""

from __future__ import annotations

import os
import platform
import sys
from argparse import ArgumentParser
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path


class Unmarked(Exception):
    """A page has no place for a table; the message says which marks it lacks."""


def marks(name: str) -> tuple[str, str]:
    """What stands before and after the table of `python -m NAME`."""
    return f"<!-- written by python -m {name} -->", f"<!-- end of python -m {name} -->"


def part(text: str, name: str) -> str:
    """What stands between the marks, without the empty lines around it. Raises Unmarked."""
    return _split(text, name)[1].strip("\n")


def check(parser: ArgumentParser, path: Path, name: str) -> None:
    """End the command, before anything is measured, when a page cannot be read or has no place for the table."""
    try:
        part(path.read_text(encoding="utf-8"), name)
    except (OSError, UnicodeDecodeError, Unmarked) as error:
        parser.error(f"{path}: {error}")


def replace(path: Path, name: str, body: str) -> None:
    """Put `body` between the marks of a page. Raises Unmarked and OSError."""
    before, _, after = _split(path.read_text(encoding="utf-8"), name)
    path.write_text(f"{before}\n\n{body}\n\n{after}", encoding="utf-8")


def _split(text: str, name: str) -> tuple[str, str, str]:
    """The text up to the first mark, what stands between them, and the text from the second: both marks included."""
    first, last = marks(name)
    if text.count(first) != 1 or text.count(last) != 1 or text.index(first) > text.index(last):
        raise Unmarked(f"the page needs the lines `{first}` and, below it, `{last}`")
    begin, end = text.index(first) + len(first), text.index(last)
    return text[:begin], text[begin:end], text[end:]


def markdown(headings: list[str], rows: list[list[str]], align: str = "---") -> str:
    """A table; `align` is the rule below each heading but the first, whose cells are words."""
    rule = "|".join(["---"] + [align] * (len(headings) - 1))
    cells = ["".join(f" {cell} |" if cell else " |" for cell in row) for row in (headings, *rows)]
    return "\n".join(f"|{line}" for line in (cells[0], f"{rule}|", *cells[1:]))


def signature(name: str, how: str, *tools: str) -> str:
    """The line below a table: which command wrote it, when, how it measured, and with what on what computer."""
    day = datetime.now(UTC).date().isoformat()
    with_what = ", ".join((f"llfsm-verify {version('llfsm-verify')}", f"Python {platform.python_version()}", *tools))
    cores = os.cpu_count() or 0
    return (
        f"Written by `python -m {name}` on {day}: {with_what}; {cores} {'core' if cores == 1 else 'cores'} "
        f"({platform.machine()}, {sys.platform}); {how}."
    )
