"""Timelines as MCAP, the container of logs that Foxglove and ROS 2 use: one channel, a JSON object for each row."""

from __future__ import annotations

import json
from decimal import Decimal
from typing import BinaryIO

from llfsm_verify.plug import Json, Shown, Signal, Timeline


def write_mcap(timeline: Timeline, file: BinaryIO) -> None:
    """Messages on the topic ``/NAME``, with the signals, ``step`` and ``cycle``; decimals are numbers.

    ModuleNotFoundError: mcap is not installed.
    """
    from mcap.writer import Writer

    writer = Writer(file)
    writer.start(profile="", library="llfsm-verify")
    fields: dict[str, Json] = {signal.name: _schema(signal) for signal in timeline.signals}
    shape: dict[str, Json] = {
        "type": "object", "properties": {"step": {"type": "integer"}, "cycle": {"type": "integer"}, **fields},
    }  # fmt: skip
    schema = writer.register_schema(name=timeline.title, encoding="jsonschema", data=json.dumps(shape).encode())
    channel = writer.register_channel(topic=f"/{timeline.title}", message_encoding="json", schema_id=schema)
    last = -1
    for number, row in enumerate(timeline.rows):
        last = max(timeline.nanoseconds(row), last + 1)
        values = {signal.name: _value(value) for signal, value in zip(timeline.signals, row.values, strict=True)}
        data = json.dumps({"step": row.step, "cycle": row.cycle, **values}).encode()
        writer.add_message(channel_id=channel, log_time=last, publish_time=last, data=data, sequence=number)
    writer.finish()  # type: ignore[no-untyped-call]


def _schema(signal: Signal) -> Json:
    if signal.labels:
        return {"enum": list(dict.fromkeys(signal.labels))}
    return {"type": "boolean" if signal.type.boolean else "number" if signal.type.digits else "integer"}


def _value(value: Shown) -> Json:
    return float(value) if isinstance(value, Decimal) else value
