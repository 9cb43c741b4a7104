"""The formats of logs, by the endings of their files. Each is read row by row."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, time
from decimal import Decimal

from llfsm_verify.registry import Entry, Registry

Cells = Mapping[str, str]
"""The texts of one row by column; a cell that has nothing is not in it."""


@dataclass(frozen=True, slots=True)
class Row:
    """One row of a log."""

    place: str
    """Where it stands, for people."""
    cells: Cells


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be read of a log."""

    columns: Collection[str]
    topic: str | None
    """The topic whose messages are the rows, where a format has topics."""


class Unreadable(Exception):
    """The log cannot be read, or not on from here; the message says why, and `hint` what to write instead."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


class NoColumn(Exception):
    """A column, or the topic, is not in the log."""

    def __init__(self, name: str, known: Collection[str]) -> None:
        super().__init__(name)
        self.name, self.known = name, tuple(known)


LOGS: Registry[Callable[[str, Wanted], Iterator[Row]]] = Registry(
    "format of logs",
    [Entry("csv", "llfsm_verify.runtime.deciding.logs.csv:read_csv", "a header, and a line for each row", (".csv",))],
    "llfsm_verify.logs",
)
"""A reader yields the rows in their order. It raises NoColumn, Unreadable, OSError."""


def cell_text(value: object) -> str | None:
    """The text of a value, as properties write values; None: there is nothing that one could write."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | str):
        return str(value).strip() or None
    if isinstance(value, float):
        return f"{Decimal(repr(value)):f}" if math.isfinite(value) else None
    if isinstance(value, Decimal):
        digits = "f" if value.is_finite() and abs(value.adjusted()) < 1000 else ""  # 1e999999999 has too many
        return f"{value:{digits}}" if value.is_finite() else None
    if isinstance(value, date | time):
        return value.isoformat()
    return None


def cells_of(value: object) -> dict[str, str]:
    """The texts of an object by its fields; `a.b` is a field of an object in it."""
    found: dict[str, str] = {}
    todo = [("", value)]
    while todo:
        name, value = todo.pop()
        if isinstance(value, dict):
            todo += [(f"{name}.{key}" if name else str(key), part) for key, part in value.items()]
        elif (text := cell_text(value)) is not None:
            found[name] = text
    return found
