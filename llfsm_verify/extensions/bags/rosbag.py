"""Logs as rosbags: files of ROS 1, and folders of ROS 2."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import fields, is_dataclass
from math import isfinite
from pathlib import Path

from llfsm_verify.extensions.bags.topics import Messages, rows
from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted, cells_of


def read_rosbag(path: str, wanted: Wanted) -> Iterator[Row]:
    """The rows, in the order of their times; a field in a message is `MESSAGE.FIELD`. Elements of arrays have no names.

    Where a bag of ROS 2 has no definitions of its messages, those of ROS 2 Humble are taken. Raises as `plug.LOGS`
    says; ModuleNotFoundError: rosbags is not installed.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    file = Path(path)
    file.stat()  # OSError: it is not there
    place = file.parent if file.suffix == ".db3" else file
    if place.suffix != ".bag" and not place.is_dir():
        raise Unreadable("a bag of ROS 1 is called `….bag`, and one of ROS 2 is a folder", "rename it")
    try:
        with AnyReader([place], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:

            def messages(of: Collection[str]) -> Messages:
                wanted = [connection for connection in reader.connections if connection.topic in of]
                for connection in wanted:
                    if connection.msgtype not in reader.typestore.fielddefs:
                        what = f"the bag does not say what a `{connection.msgtype}` is, of `{connection.topic}`"
                        raise Unreadable(what, "record it again with ROS 2 Iron or newer, which keeps definitions")
                for connection, time, data in reader.messages(connections=wanted):
                    message = reader.deserialize(data, connection.msgtype)
                    yield connection.topic, time, cells_of(_plain(message))

            yield from rows(wanted, sorted({connection.topic for connection in reader.connections}), messages)
    except (NoColumn, Unreadable):
        raise
    except Exception as error:  # noqa: BLE001 - what the library raises where a file is damaged, which is many kinds
        raise Unreadable(f"{type(error).__name__}: {error}".rstrip(": ")) from None


def _plain(value: object) -> object:
    """A message as a mapping of its fields, with words for `nan`, `inf` and `-inf`."""
    if not is_dataclass(value):
        return str(value) if isinstance(value, float) and not isfinite(value) else value
    return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
