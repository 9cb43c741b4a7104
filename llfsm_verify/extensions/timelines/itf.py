"""Timelines in the Informal Trace Format, the JSON of Apalache, Quint and their viewers (ADR 015 of Apalache)."""

from __future__ import annotations

import json
from decimal import Decimal
from typing import BinaryIO

from llfsm_verify.plug import Json, Shown, Timeline, text
from llfsm_verify.plug import TimelineRow as Row

EXACT = 1 << 53
"""Whole numbers that are not smaller are written as ``{"#bigint": "…"}``, since readers may hold others as doubles."""


def write_itf(timeline: Timeline, file: BinaryIO) -> None:
    """A state for each row, with the signals as its variables; its ``#meta`` has step, cycle, time and what fired.
    Decimals, which the format does not have, are strings, as states and values of enumerations are. ``loop`` is the
    state that follows the last one."""
    names = [signal.name for signal in timeline.signals]
    meta: dict[str, Json] = {
        "format": "ITF", "format-description": "https://apalache-mc.org/docs/adr/015adr-trace.html",
        "description": timeline.title,
    }  # fmt: skip
    file.write(f'{{"#meta": {_json(meta)},\n"vars": {_json(list(names))},\n"states": ['.encode())
    loop = None
    for index, row in enumerate(timeline.rows):
        if loop is None and timeline.loop is not None and row.step == timeline.loop:
            loop = index
        values = dict(zip(names, map(_value, row.values), strict=True))
        file.write(f"{',' if index else ''}\n{_json({'#meta': _meta(timeline, index, row), **values})}".encode())
    end = "" if loop is None else f', "loop": {loop}'
    file.write(f"\n]{end}}}\n".encode())


def _meta(timeline: Timeline, index: int, row: Row) -> Json:
    time = timeline.time_ms(row)
    when: dict[str, Json] = {} if time is None else {"time_ms": float(time)}
    return {"index": index, "step": row.step, "cycle": row.cycle, **when, "fired": list(row.fired)}


def _value(value: Shown) -> Json:
    if isinstance(value, Decimal):
        return text(value)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= EXACT:
        return {"#bigint": str(value)}
    return value


def _json(value: Json) -> str:
    return json.dumps(value, ensure_ascii=False)
