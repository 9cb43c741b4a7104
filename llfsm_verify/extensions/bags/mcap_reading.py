"""Logs as MCAP, whose messages are JSON."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from decimal import Decimal
from pathlib import Path

from llfsm_verify.extensions.bags.topics import Messages, rows
from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted, cells_of


def read_mcap(path: str, wanted: Wanted) -> Iterator[Row]:
    """The rows, in the order of their times; a field in an object is `OBJECT.FIELD`. Raises as `plug.LOGS` says;
    ModuleNotFoundError: mcap is not installed.
    """
    from mcap.reader import make_reader

    with Path(path).open("rb") as file:
        try:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            if summary is None:
                raise Unreadable("it has no summary, so it was not written to its end")

            def messages(of: Collection[str]) -> Messages:
                for _, channel, message in reader.iter_messages(topics=sorted(of)):
                    if channel.message_encoding != "json":
                        raise Unreadable(f"the messages of `{channel.topic}` are not JSON: {channel.message_encoding}")
                    yield channel.topic, message.log_time, cells_of(_value(message.data, channel.topic))

            yield from rows(wanted, sorted({channel.topic for channel in summary.channels.values()}), messages)
        except (NoColumn, Unreadable):
            raise
        except Exception as error:  # noqa: BLE001 - what the library raises where a file is damaged, which is many kinds
            raise Unreadable(f"{type(error).__name__}: {error}".rstrip(": ")) from None


def _value(data: bytes, topic: str) -> object:
    try:
        return json.loads(data, parse_float=Decimal, parse_constant=str)
    except (ValueError, RecursionError):
        raise Unreadable(f"a message of `{topic}` is not JSON") from None
