"""Logs as MCAP: each message of one topic is a row, with the last message of every other topic beside it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted, cells_of

TIME = "log_time"
"""A column that every message has: nanoseconds."""


def read_mcap(path: str, wanted: Wanted) -> Iterator[Row]:
    """The rows, in the order of their times. A column is a field of the topic, or `TOPIC:FIELD` of another one.

    A field in an object is `OBJECT.FIELD`. The topic need not be named where there is only one. Raises as
    `plug.LOGS` says; ModuleNotFoundError: mcap is not installed.
    """
    from mcap.reader import make_reader

    with Path(path).open("rb") as file:
        try:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            if summary is None:
                raise Unreadable("it has no summary, so it was not written to its end")
            topics = sorted({channel.topic for channel in summary.channels.values()})
            topic = _topic(wanted, topics)
            places = {column: _place(column, topic, topics) for column in wanted.columns}
            read = {topic, *(of for of, _ in places.values())}
            last: dict[str, dict[str, str]] = {}
            known: set[str] = set()
            number = 0
            for _, channel, message in reader.iter_messages(topics=sorted(read)):
                if channel.message_encoding != "json":
                    raise Unreadable(f"the messages of `{channel.topic}` are not JSON: {channel.message_encoding}")
                fields = _fields(message.data, channel.topic)
                fields[TIME] = str(message.log_time)
                last[channel.topic] = fields
                if channel.topic != topic:
                    continue
                number += 1
                known |= fields.keys()
                found = {column: last.get(of, {}).get(field) for column, (of, field) in places.items()}
                missing = next((c for c, (of, field) in places.items() if of == topic and field not in known), None)
                if missing is not None and number == 1:
                    raise NoColumn(missing, sorted(known))
                yield Row(f"message {number}", {c: text for c, text in found.items() if text is not None})
        except (NoColumn, Unreadable):
            raise
        except Exception as error:  # noqa: BLE001 - what the library raises where a file is damaged, which is many kinds
            raise Unreadable(f"{type(error).__name__}: {error}".rstrip(": ")) from None


def _topic(wanted: Wanted, topics: list[str]) -> str:
    if wanted.topic is not None:
        if wanted.topic not in topics:
            raise NoColumn(wanted.topic, topics)
        return wanted.topic
    if len(topics) != 1:
        raise Unreadable(f"it has {len(topics)} topics ({', '.join(topics[:8])}): say `topic: …` in the mapping")
    return topics[0]


def _place(column: str, topic: str, topics: list[str]) -> tuple[str, str]:
    """The topic and the field of a column."""
    for other in topics:
        if column.startswith(f"{other}:"):
            return other, column[len(other) + 1 :]
    return topic, column


def _fields(data: bytes, topic: str) -> dict[str, str]:
    try:
        value = json.loads(data, parse_float=Decimal)
    except (ValueError, RecursionError):
        raise Unreadable(f"a message of `{topic}` is not JSON") from None
    return cells_of(value)
