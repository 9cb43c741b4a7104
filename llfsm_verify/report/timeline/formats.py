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
        Entry("vcd", "llfsm_verify.report.timeline.vcd:write_vcd", "for GTKWave and other viewers", (".vcd",)),
        Entry("svg", "llfsm_verify.report.timeline.diagram:write_svg", "a timing diagram", (".svg",)),
        Entry("itf", "llfsm_verify.report.timeline.itf:write_itf", "for Apalache and Quint", (".itf.json",)),
    ],
    "llfsm_verify.timelines",
)
