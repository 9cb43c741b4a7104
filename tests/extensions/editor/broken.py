"""Files broken at every line, and what the readers of the command line say of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.doubts import doubts
from llfsm_verify.checking.problem import bind
from llfsm_verify.cli.commands.check.run import find_owners, properties_beside
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source

Told = set[tuple[str, str, str]]
"""File, code and message, and whether it is an error is in the code."""


def broken(text: str) -> Iterator[str]:
    """The text with each line deleted, doubled and garbled."""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        before, after = lines[:number], lines[number + 1 :]
        yield "\n".join([*before, *after])
        yield "\n".join([*before, line, line, *after])
        middle = len(line) // 2
        yield "\n".join([*before, line[:middle] + "{'@\U0001f600" + line[middle + 1 :], *after])


def said_on_disk(path: Path) -> Told:
    """What the command line says of the arrangements that a saved file belongs to; see `said_of`."""
    found: Told = set()
    for root in find_owners(path):
        found |= {told(d, root) for d in said_of(root)}
    return found


def said_of(root: Path) -> list[Diagnostic]:
    """All diagnostics of an arrangement and the properties beside it, by the steps of `llfsm check`."""
    try:
        arrangement = load_arrangement(root)
        found = list(arrangement.warnings)
    except DiagnosticError as error:
        return list(error.diagnostics)
    try:
        properties = parse_properties([read_source(file) for file in properties_beside(root)])
        found += doubts(arrangement, properties)
        bind(arrangement, properties)
    except DiagnosticError as error:
        found += error.diagnostics
    return found


def told(d: Diagnostic, root: Path) -> tuple[str, str, str]:
    """A diagnostic as a test compares it: place and message, with notes and hint."""
    place = d.span.file if d.span is not None else d.file or str(root)
    where = Path(place).resolve().as_uri()
    start = (0, 0) if d.span is None else (d.span.line - 1, _utf16(d))
    notes = "".join(f"\nnote: {note}" for note in d.notes)
    hint = "" if d.hint is None else f"\nhint: {d.hint}"
    return f"{where}:{start[0]}:{start[1]}", d.code, d.message + notes + hint


def _utf16(d: Diagnostic) -> int:
    assert d.span is not None
    line = d.span.source.text[: d.span.start].rsplit("\n", 1)[-1]
    return len(line.encode("utf-16-le")) // 2
