"""From a message of ROSMonitoring to its answer."""

from __future__ import annotations

import json
from decimal import Decimal

from llfsm_verify import DiagnosticError
from llfsm_verify.plug import LogReading, Row, cells_of

WRONG = "a message is a JSON object with a `topic` or a `service`"


class Monitor:
    """What one connection has sent so far. `reading`: of no message yet."""

    def __init__(self, reading: LogReading, *, filtering: bool) -> None:
        self._reading = reading.copied()
        self._filtering = filtering
        self._last: dict[str, dict[str, str]] = {}
        """The fields of the newest message of each topic and service."""

    def answer(self, message: str | bytes) -> str:
        """The message with its verdict. One that cannot be read, or has no letter, changes nothing."""
        event: object = None
        try:
            event, exact = json.loads(message), json.loads(message, parse_float=Decimal)
            if not isinstance(event, dict):
                raise ValueError(WRONG)
            found = self._read(exact)
        except DiagnosticError as error:
            found = {"error": error.diagnostics[0].message}
        except (ValueError, RecursionError, OverflowError) as error:
            found = {"error": str(error)}
        echo = event if isinstance(event, dict) else {}
        return json.dumps({**echo, "verdict": "unknown", **found}, ensure_ascii=False)

    def _read(self, event: dict[str, object]) -> dict[str, str]:
        name = event.get("topic", event.get("service"))
        if not isinstance(name, str):
            raise ValueError(WRONG)
        last = {**self._last, name: cells_of(event)}
        reading = self._reading.copied()
        if reading.mapping.topic in (None, name):
            places = {column: column.rpartition(":")[::2] for column in reading.columns}
            if all(topic in last for topic, _ in places.values() if topic):  # else a topic has said nothing yet
                found = {column: last[topic or name].get(field) for column, (topic, field) in places.items()}
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
