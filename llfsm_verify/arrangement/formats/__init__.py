"""The formats of arrangements and machines, by name: for each a reader, which makes a draft, and for some a writer.

A reader says what is wrong with a file as far as it cannot read it; everything else is for `resolve`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.arrangement.draft import Draft
    from llfsm_verify.arrangement.formats.writing import NewMachine, Writer
    from llfsm_verify.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Given:
    """What a reader of arrangements is asked to read."""

    path: str | Path
    """``-``: standard input; the name of the text, where there is one."""
    text: str | None = None
    stdin: TextIO | None = None
    """What takes the place of standard input."""
    named_at: Span | None = None
    """The path stands at this place in a file: only a regular file is read, and nothing of a file that does not look
    like an arrangement is shown."""
    files: Mapping[str, str] | None = None
    """Texts of machine files by their paths, which are read instead of what is there; `text` is then looked at as if it
    stood at `path`."""


ARRANGEMENTS: Registry[Callable[[Given], Draft]] = Registry(
    "arrangement format",
    [Entry("yaml", "llfsm_verify.arrangement.formats.yaml:read_arrangement", "YAML", (".yaml", ".yml"))],
    "llfsm_verify.arrangements",
)
"""Of whole arrangements. A reader raises DiagnosticError for a file that it cannot open."""

WRITERS: Registry[Writer] = Registry(
    "writer of arrangements",
    [Entry("yaml", "llfsm_verify.arrangement.formats.yaml_writer:WRITER", "YAML")],
    "llfsm_verify.writers",
)
"""Beside `ARRANGEMENTS`, by the same names."""

USUAL = "yaml"
"""The format of a file whose name has no ending that stands for one."""


def read_arrangement(given: Given, format_name: str | None = None) -> Draft:
    """The draft of an arrangement in the format of that name (None: the one that the path's ending stands for).

    Unregistered: there is no such format. DiagnosticError: there is no such file, or it cannot be read.
    """
    return ARRANGEMENTS.load(format_name or ARRANGEMENTS.named_by(str(given.path)) or USUAL)(given)


def writer_of(path: str) -> Writer:
    """The writer for a file at `path`. Unregistered: the format that its ending stands for can only be read."""
    return WRITERS.load(ARRANGEMENTS.named_by(path) or USUAL)


def machine_in(machine: NewMachine, format_name: str = USUAL) -> str:
    """The text of a file with one machine in the format of that name, whose writer writes machines."""
    write = WRITERS.load(format_name).machine
    assert write is not None, format_name
    return write(machine)


def ending_of(path: str) -> str:
    """The ending of files in the format of the file at `path`, the one that is written."""
    return ARRANGEMENTS[ARRANGEMENTS.named_by(path) or USUAL].suffixes[0]
