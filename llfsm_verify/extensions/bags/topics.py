"""Rows from messages of several topics: each message of one, with the last message of every other topic beside it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted

TIME = "log_time"
"""A column that every message has: nanoseconds."""
Messages = Iterable[tuple[str, int, Mapping[str, str]]]
"""The topic, the time and the fields of each message, in the order of times."""


def rows(wanted: Wanted, topics: list[str], messages: Callable[[Collection[str]], Messages]) -> Iterator[Row]:
    """A column is a field of the topic, `TOPIC:FIELD` of another one, or `TIME`. `messages`: those of some topics.

    The topic need not be named where there is only one. NoColumn; Unreadable.
    """
    topic = _topic(wanted, topics)
    places = {column: _place(column, topic, topics) for column in wanted.columns}
    last: dict[str, dict[str, str]] = {}
    number = 0
    for name, time, fields in messages({topic, *(of for of, _ in places.values())}):
        last[name] = {**fields, TIME: str(time)}
        if name != topic:
            continue
        number += 1
        found = {column: last.get(of, {}).get(field) for column, (of, field) in places.items()}
        missing = next((c for c, (of, field) in places.items() if of == topic and field not in last[topic]), None)
        if missing is not None and number == 1:
            raise NoColumn(missing, sorted(last[topic]))
        yield Row(f"message {number}", {c: text for c, text in found.items() if text is not None})


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
