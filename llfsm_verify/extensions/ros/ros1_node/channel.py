"""Lines of JSON to and from the run, over the socket that is standard input and output."""

from __future__ import annotations

import json
import os
import sys
import threading
from decimal import Decimal
from typing import Any, Dict, Iterator, List, Mapping, Optional

MOST_WAITING = 10_000
"""Events that wait until the run reads them."""


class Channel:
    """Takes standard input and output for itself: what else is printed goes to standard error.

    Values that the run has not read yet are replaced by newer ones of the same fields; those of `events` are not.
    Who finds nobody writing writes for all others, so that there is no thread for it and no time is lost.
    """

    def __init__(self) -> None:
        self._in, self._out = os.fdopen(os.dup(0), "rb"), os.dup(1)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        self._lock = threading.Lock()
        self._waiting: List[Dict[str, Any]] = []
        self._newest: Optional[Dict[str, Any]] = None
        """The last of what waits, if newer values may join it."""
        self._fed: Dict[int, Dict[str, Any]] = {}
        """Feedback that waits, by the request; newer one takes its place."""
        self._full = False
        """Whether something was left out."""
        self._writes = True
        """Somebody writes; until `first`, nobody may."""

    def lines(self) -> Iterator[Dict[str, Any]]:
        """What the run says, until it is gone. Numbers are exact."""
        for line in self._in:
            said = json.loads(line, parse_float=Decimal)
            if isinstance(said, dict):
                yield said

    def first(self, message: Mapping[str, Any]) -> None:
        """Tell the first line, and after it what has come meanwhile."""
        with self._lock:
            self._waiting.insert(0, {"": message})
            self._writes = False
        self._write()

    def values(self, values: Mapping[str, Any], event: bool = False) -> None:
        """Tell values by field."""
        with self._lock:
            if event or self._newest is None:
                self._newest = None if event else {}
                self._append(self._newest if self._newest is not None else dict(values))
            if self._newest is not None:
                self._newest.update(values)
        self._write()

    def tell(self, message: Mapping[str, Any]) -> None:
        """Tell something else, after all that waits."""
        with self._lock:
            self._newest = None
            self._append({"": message})
        self._write()

    def feed(self, number: int, state: str, values: Mapping[str, Any]) -> None:
        """Tell the feedback of a request, in the place of one that waits."""
        with self._lock:
            waiting = self._fed.get(number, {})
            if waiting.get("state") != state:
                waiting = self._fed[number] = {"state": state, "of": number}
                self._newest = None
                self._append({"": waiting})
            waiting["values"] = values
        self._write()

    def _append(self, what: Dict[str, Any]) -> None:
        """Let it wait; what waits longest makes room, unless it belongs to a request."""
        if len(self._waiting) >= MOST_WAITING:
            may_go = (not {"of", "answer"} & one.get("", one).keys() for one in self._waiting)
            least = next((number for number, may in enumerate(may_go) if may), None)
            if least is not None:
                del self._waiting[least]
            self._full = True
        self._waiting.append(what)

    def lost(self, fields: List[str], why: str) -> None:
        """Tell that these inputs have failed."""
        self.tell({"lost": sorted(fields), "why": why} if fields else {"say": why})

    def say(self, text: str) -> None:
        """Show a text to the user."""
        self.tell({"say": text})

    def _write(self) -> None:
        with self._lock:
            if self._writes:
                return
            self._writes = True
        while True:
            with self._lock:
                waiting, self._waiting, self._newest, self._fed = self._waiting, [], None, {}
                if self._full:
                    self._full = False
                    waiting.append({"": {"say": "the run does not read as fast as messages come: some are left out"}})
                if not waiting:
                    self._writes = False
                    return
            data = b"".join(map(_line, waiting))
            try:
                while data:
                    data = data[os.write(self._out, data) :]
            except OSError:  # the run is gone
                os._exit(0)


def _line(waiting: Dict[str, Any]) -> bytes:
    message = waiting[""] if "" in waiting else {"values": nested(waiting)}
    return json.dumps(message).encode() + b"\n"


def nested(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Values by field as objects in objects, where fields have dots."""
    found: Dict[str, Any] = {}
    for field, value in values.items():
        *outer, last = field.split(".")
        place = found
        for part in outer:
            place = place.setdefault(part, {})
        place[last] = value
    return found


def flat(values: Mapping[str, Any], before: str = "") -> Dict[str, Any]:
    """The opposite of `nested`."""
    found: Dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            found.update(flat(value, f"{before}{name}."))
        else:
            found[before + name] = value
    return found
