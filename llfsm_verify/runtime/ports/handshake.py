"""The side of a request that is not the arrangement's: the port's, as `requests` describes it."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Protocol

from llfsm_verify.arrangement.requests import IDLE, STATES, UNDER_WAY, Request
from llfsm_verify.jsonvalue import Json

FAILURES = {"service": "FAILED", "action": "LOST"}
TIMEOUTS = {"service": "TIMED_OUT", "action": "LOST"}
UNBEGUN = ("RECALLED", "REJECTED", "LOST")
"""Ends of an action that was never active."""


class Asked(Protocol):
    """What a handshake does."""

    def show(self, request: Request, state: str, answers: Mapping[str, str], values: Mapping[str, Json]) -> None:
        """Post the state, and those inputs of `answers` (the field of each) of which there is a value, together."""

    def number(self, handshake: Handshake) -> int:
        """A number for what it asks next."""

    def ask(self, request: Request, number: int) -> None:
        """Send it."""

    def cancel(self, number: int) -> None:
        """Its answer is not wanted any more."""


class Handshake:
    """One request, its times in the unit of its time-out. Each of its states is seen by a cycle before the next one
    comes, as its plant has it."""

    def __init__(self, request: Request, asked: Asked) -> None:
        self.request, self._asked = request, asked
        self.number = 0
        """Of what is under way; 0: nothing is."""
        self.state = IDLE
        """What is posted."""
        self._seen, self._shown = False, False
        """The newest `ask`, and whether a frame has had the state."""
        self._next: deque[tuple[str, Mapping[str, Json]]] = deque()
        self._last = IDLE
        """The state that was reported last."""
        self._cancelled = False
        self._since = 0.0

    def begin(self) -> None:
        """Before the first cycle."""
        self._show(IDLE, {})

    def see(self, ask: bool, *, shown: bool, now: float) -> None:
        """A frame has this value of `ask`, and has `shown` the state that is posted, or another one."""
        self._seen, self._shown = ask, self._shown or shown
        self._move(now)

    def look(self, now: float) -> None:
        """Whether it takes too long."""
        limit = self.request.timeout
        if limit is not None and self.number and now >= self._since + limit:
            self.withdraw()
            self._close(TIMEOUTS[self.request.kind], {})
            self._move(now)

    def report(self, state: str, values: Mapping[str, Json], now: float, *, end: bool) -> str | None:
        """What the other side says of its number; a state "" is a failure. What is wrong with it."""
        kind, problem = self.request.kind, None
        if not end:
            if kind == "service" or state not in UNDER_WAY["action"] or (state, self._last) == ("PENDING", "ACTIVE"):
                return f"a state that request `{self.request.name}` cannot have now: `{state[:40]}`"
            if state != self._last:
                self._next.append((state, values))
                self._last = state
            elif self._next:
                self._next[-1] = (state, {**self._next[-1][1], **values})
            elif values:
                self._asked.show(self.request, self.state, self.request.feedback, values)
        else:
            ends = set(STATES[kind]) - {IDLE, *UNDER_WAY[kind]} - ({"TIMED_OUT"} if kind == "service" else set())
            if self._last == "ACTIVE":
                ends -= {"RECALLED", "REJECTED"}
            if state == "DONE" and kind == "action":
                state = "SUCCEEDED"
            if state not in ends:
                problem = f"an end that request `{self.request.name}` cannot have: `{state[:40]}`" if state else None
                state, values = FAILURES[kind], {}
            self._close(state, values)
        self._move(now)
        return problem

    def withdraw(self) -> None:
        """What is under way is not wanted any more."""
        if self.number and not self._cancelled:
            self._cancelled = True
            self._asked.cancel(self.number)

    def _close(self, state: str, values: Mapping[str, Json]) -> None:
        if self.request.kind == "action" and self._last == "PENDING" and state not in UNBEGUN:
            self._next.append(("ACTIVE", {}))
        self._next.append((state, values))
        self.number, self._last = 0, state

    def _move(self, now: float) -> None:
        kind = self.request.kind
        under_way = self.state in UNDER_WAY[kind]
        if under_way and not self._seen and self.number:
            self.withdraw()
            if kind == "service":  # also where it is wanted again before a frame has shown that it is asked
                self._close(FAILURES[kind], {})
        if not self._shown:
            return
        if self.state == IDLE:
            if self._seen:
                self._begin(now)
        elif under_way:
            if kind == "service" and not self._seen:
                self._show(IDLE, {})
            elif self._next:
                self._show(*self._next.popleft())
        elif not self._seen:
            self._show(IDLE, {})

    def _begin(self, now: float) -> None:
        self._since, self._cancelled = now, False
        self._last = UNDER_WAY[self.request.kind][0]
        self._show(self._last, {})
        self.number = self._asked.number(self)
        self._asked.ask(self.request, self.number)

    def _show(self, state: str, values: Mapping[str, Json]) -> None:
        under_way = state in UNDER_WAY["action"]
        self.state, self._shown = state, False
        if state == IDLE:
            self.number = 0
            self._next.clear()
        self._asked.show(self.request, state, self.request.feedback if under_way else self.request.answers, values)
