"""The formats of timelines, by the names that ``--to`` knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, BinaryIO

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.runtime.recording.timeline import Timeline

TIMELINES: Registry[Callable[[Timeline, BinaryIO], None]] = Registry(
    "format of timelines",
    [
        Entry("csv", "llfsm_verify.report.timeline.table:write_csv", "a row for each moment", (".csv",)),
    ],
    "llfsm_verify.timelines",
)
