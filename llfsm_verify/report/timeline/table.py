"""Timelines as CSV: a column for each signal, as `llfsm whiteboard get` prints its values."""

from __future__ import annotations

import csv
import io
from typing import BinaryIO

from llfsm_verify.runtime.recording.timeline import Timeline
from llfsm_verify.values import text


def write_csv(timeline: Timeline, file: BinaryIO) -> None:
    """Columns ``step``, ``cycle``, ``time_ms`` (empty where the arrangement is untimed), the signals, and ``fired``."""
    lines = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(["step", "cycle", "time_ms", *(signal.name for signal in timeline.signals), "fired"])
    for row in timeline.rows:
        time = timeline.time_ms(row)
        when = "" if time is None else f"{float(time):.15g}"
        writer.writerow([row.step, row.cycle, when, *map(text, row.values), "; ".join(row.fired)])
    lines.detach()
