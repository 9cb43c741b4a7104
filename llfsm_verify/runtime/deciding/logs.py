"""Logs of other programs: their formats, and what decides properties on them, which are found by registries."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, time
from decimal import Decimal
from typing import TYPE_CHECKING, Protocol

from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.logic.properties import PropertySet
    from llfsm_verify.runtime.deciding.recordings import Decided

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


LOGS: Registry[Callable[[str, Wanted], Iterator[Row]]] = Registry("format of logs", (), "llfsm_verify.logs")
"""A reader, by the ending of the file's name, yields the rows in their order. It raises NoColumn, Unreadable, OSError.
"""


class LogReading(Protocol):
    """Properties on a log as far as it was read: `count` rows."""

    count: int

    @property
    def topic(self) -> str | None:
        """That whose messages are the rows, where a format has topics."""

    @property
    def slots(self) -> frozenset[str]:
        """The columns that are slots of the arrangement."""

    @property
    def columns(self) -> frozenset[str]:
        """Those whose cells each row has to have."""

    def copied(self) -> LogReading:
        """The same, which then reads for itself."""

    def read(self, row: Row) -> object:
        """The next row. DiagnosticError: a cell is wrong; OverflowError: the row has no letter."""

    def decided(self, open_end: str) -> list[Decided]:
        """What is known of each property; `open_end`: why there is no more."""

    def check(self, form: str) -> list[Decided]:
        """The properties on the whole log, which is of a format of LOGS. ModuleNotFoundError; DiagnosticError."""


READINGS: Registry[Callable[[Arrangement, PropertySet, str, str], LogReading]] = Registry(
    "reading of logs", (), "llfsm_verify.readings"
)
"""From properties, the path of a mapping and that of a log (or what it is called). DiagnosticError."""


class Oracle(Protocol):
    """Answers monitors of other systems, message by message, until SIGINT or SIGTERM: each connection by a copy of
    `reading`.

    `filtering`: a message that violates a property is refused, and counts as not sent. `tell` is told the address, and
    notes. DiagnosticError: it cannot listen there.
    """

    def __call__(
        self, reading: LogReading, host: str, port: int, *, filtering: bool, tell: Callable[[str], None]
    ) -> None: ...


ORACLES: Registry[Oracle] = Registry("oracle", (), "llfsm_verify.oracles")


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
