"""From a message of ROSMonitoring to its answer."""

from __future__ import annotations

import json
from collections.abc import Callable
from decimal import Decimal

from llfsm_verify import DiagnosticError
from llfsm_verify.plug import LogReading, Row, cells_of

WRONG = "a message is a JSON object with a `topic` or a `service`"


NAMED_TOPICS = 100
"""Topics that are named."""


class Monitor:
    """What one connection has sent so far. `reading`: of no message yet. `say` is told once what concerns nothing, by
    way of the names in `said`, which the monitors of a server share."""

    def __init__(self, reading: LogReading, say: Callable[[str], None], said: set[str], *, filtering: bool) -> None:
        self._reading = reading.copied()
        self._filtering, self._say, self._said = filtering, say, said
        self._places = {column: column.rpartition(":")[::2] for column in reading.columns}
        """Of each column, its topic (or none) and field."""
        self._topics = {topic for topic, _ in self._places.values() if topic}
        plain = any(not self._places[column][0] for column in reading.slots)
        self._known = None if plain and reading.topic is None else self._topics | {reading.topic or ""} - {""}
        """Topics that say something; None: all do."""
        self._last: dict[str, dict[str, str]] = {}
        """The fields of the newest message of each topic and service."""

    def answer(self, message: str | bytes) -> str:
        """The message with its verdict. One that cannot be read, or has no letter, changes nothing."""
        sent = ""
        try:
            text = message if isinstance(message, str) else message.decode()
            event = json.loads(text, parse_float=Decimal)
            if not isinstance(event, dict):
                raise ValueError(WRONG)
            sent = text.strip()[1:-1].strip()  # as it was written: its numbers may be none of Python
            found = self._read(event)
        except DiagnosticError as error:
            found = {"error": error.diagnostics[0].message}
        except (ValueError, RecursionError, ArithmeticError) as error:
            found = {"error": str(error)}
        told = json.dumps({"verdict": "unknown", **found})[1:]
        return f"{{{sent}, {told}" if sent else f"{{{told}"

    def _read(self, event: dict[str, object]) -> dict[str, str]:
        name = event.get("topic", event.get("service"))
        if not isinstance(name, str):
            raise ValueError(WRONG)
        last = {**self._last, name: cells_of(event)}
        reading = self._reading.copied()
        if self._known is not None and name not in self._known | self._said and len(self._said) < NAMED_TOPICS:
            self._said.add(name)
            known = ", ".join(sorted(map(str, self._known)))
            self._say(f"no column is of the topic `{name[:100]}`: the mapping has {known}")
        if reading.topic in (None, name):
            if last.keys() >= self._topics:  # else a topic has said nothing yet
                found = {column: last[topic or name].get(field) for column, (topic, field) in self._places.items()}
                cells = {column: text for column, text in found.items() if text is not None}
                reading.read(Row(f"message {reading.count + 1}", cells))
        verdict = _verdict(reading)
        if self._filtering and verdict["verdict"] == "false":
            return {**verdict, "verdict": "currently_false"}
        self._reading, self._last = reading, last
        return verdict


def _verdict(reading: LogReading) -> dict[str, str]:
    found = reading.decided("")
    violated = [decided.line.text for decided in found if decided.verdict == "violated"]
    if violated:
        return {"verdict": "false", "spec": "; ".join(violated)}
    return {"verdict": "true" if all(decided.verdict == "satisfied" for decided in found) else "unknown"}
