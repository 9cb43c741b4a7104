"""What a run asks of another program through a port: requests of services, and goals of actions.

Both are a handshake of two signals, so that no cycle waits and nothing is missed: `ask`, which the arrangement writes,
and `state`, an input. A machine sets `ask`, reads `state` until it tells the end, takes the answers, resets `ask`, and
waits for ``IDLE``. The plants of the same names (`environment: {use: service}`) make every order of events that this
allows (decision 70).

    service   IDLE -> WAITING -> DONE | FAILED | TIMED_OUT -> IDLE
    action    IDLE -> PENDING -> ACTIVE -> SUCCEEDED | PREEMPTED | ABORTED | LOST -> IDLE
                      PENDING -> RECALLED | REJECTED | LOST -> IDLE
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

RequestKind = Literal["service", "action"]
IDLE = "IDLE"
SERVICE_STATES = (IDLE, "WAITING", "DONE", "FAILED", "TIMED_OUT")
ACTION_STATES = (
    IDLE, "PENDING", "ACTIVE", "PREEMPTED", "RECALLED", "REJECTED", "ABORTED", "LOST", "SUCCEEDED",
)  # fmt: skip
"""Those of a client of actionlib, and ``IDLE``. The thesis on CROPS names them without ``ABORTED``."""
STATES: Mapping[RequestKind, tuple[str, ...]] = {"service": SERVICE_STATES, "action": ACTION_STATES}
MOVES: Mapping[RequestKind, Mapping[str, tuple[str, ...]]] = {
    "service": {"WAITING": SERVICE_STATES[2:]},
    "action": {
        "PENDING": ("ACTIVE", "RECALLED", "REJECTED", "LOST"),
        "ACTIVE": ("SUCCEEDED", "PREEMPTED", "ABORTED", "LOST"),
    },
}
"""What can follow each state that is under way, by itself."""
UNDER_WAY = {"service": ("WAITING",), "action": ("PENDING", "ACTIVE")}
"""The states in which an answer is still to come."""


@dataclass(frozen=True, slots=True)
class Request:
    """A service or an action that a run asks for."""

    name: str
    kind: RequestKind
    ask: str
    """The slot, `bool`: true asks, false says that the answer was taken, or that it is not wanted any more."""
    state: str
    """The input that has one of `STATES`, or what `values` of the port makes of it."""
    sends: Mapping[str, str] = field(default_factory=dict)
    """The field of the request that shows each slot, by the slot; they are read when `ask` becomes true."""
    answers: Mapping[str, str] = field(default_factory=dict)
    """The field of the answer that feeds each input, by the input."""
    feedback: Mapping[str, str] = field(default_factory=dict)
    """Of an action: the field of the feedback that feeds each input, by the input."""
    timeout: float | None = None
    """Seconds of the run, in cycles, after which a service is ``TIMED_OUT`` and an action ``LOST``; None: never."""
    told: Mapping[str, str] = field(default_factory=dict)
    """What the kind of port says of it to the child, such as the name of a service."""
    values: Mapping[str, str] = field(default_factory=dict)
    """For states that the type of `state` lacks, those that stand for them."""

    def called(self, state: str) -> str:
        """A state as the arrangement calls it."""
        return self.values.get(state, state)

    @property
    def fed(self) -> tuple[str, ...]:
        """The inputs to which it gives values."""
        return (self.state, *self.answers, *self.feedback)
