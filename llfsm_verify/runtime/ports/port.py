"""What a port is, what the file of ports says of it, and the kinds of ports by name.

A kind of port makes a `Port`, which moves messages: fields with values. What they mean for the run is the business of
the `Link` that the port gets.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, get_args

from llfsm_verify.arrangement.requests import Request
from llfsm_verify.diagnostics import Span
from llfsm_verify.jsonvalue import Json
from llfsm_verify.registry import Entry, Registry
from llfsm_verify.runtime.ports import UNKNOWN
from llfsm_verify.values import Shown
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark
from llfsm_verify.yaml.tables import Table

OnFailure = Literal["stale", "safe", "stop"]
ON_FAILURE: tuple[OnFailure, ...] = get_args(OnFailure)


class Unopened(Exception):
    """A port cannot be opened; the message says why, the hint what to do."""

    def __init__(self, why: str, hint: str) -> None:
        super().__init__(why)
        self.hint = hint


class Link(Protocol):
    """The run, as a port sees it. All of this is called on the thread that serves the port."""

    @property
    def name(self) -> str:
        """The port's."""

    @property
    def fields(self) -> frozenset[str]:
        """Those that feed inputs."""

    @property
    def latest(self) -> int:
        """The cycle of the newest outputs."""

    @property
    def repeats(self) -> bool:
        """Whether who takes the place of the other side is told the newest values again: not where they are sent `when`
        something changes.
        """

    def hello(self, told: Mapping[str, Json]) -> dict[str, Json]:
        """What a program is told first: see `runtime/ports/process`; `told` is what the kind adds."""

    def take(self, values: Mapping[str, Json]) -> None:
        """A message has come: the values of some fields."""

    def malformed(self, why: str) -> None:
        """Something has come that is no message."""

    def lost(self, why: str, *, forever: bool = False, fields: Collection[str] | None = None) -> None:
        """Where messages come from is gone: `forever`, or it may come back by itself. Of these fields, or of all."""

    def report(self, number: int, state: str, values: Mapping[str, Json], *, end: bool) -> None:
        """The request of this number is in this state now, and `values` are its feedback, or at the end its answer."""

    def fail_requests(self, why: str) -> None:
        """All requests under way have failed."""

    def say(self, what: str) -> None:
        """Show it to the user, once for each text."""

    def cycle(self, number: int, values: Mapping[str, Json]) -> None:
        """With `clock: external`: the next cycle begins, and has these values of some fields."""

    def sent(self) -> None:
        """A message is on its way, as a whole."""

    def unsent(self, why: str) -> None:
        """A message will never be sent, because a newer one took its place or the other side is gone."""


class Port(Protocol):
    """A port that is open. No call may wait for the other side. A class may inherit what it has nothing to do for."""

    every_frame: bool
    """Whether `send` is called for each frame that is seen, and not only where a value has changed."""

    def waits(self) -> Iterable[tuple[int, int]]:
        """The descriptors to watch, with the events of `select.poll`."""
        return ()

    def serve(self, ready: Mapping[int, int], now: float) -> None:  # noqa: ARG002 - a kind may need none
        """Move what can be moved; `ready` has the events of its descriptors, `now` is in seconds."""
        return

    def send(self, values: Mapping[str, Shown]) -> None:  # noqa: ARG002 - a kind may need none
        """The newest values of all its outputs by field. They take the place of a message that is not sent yet."""
        return

    @property
    def flushed(self) -> bool:
        """Whether nothing is left to send."""
        return True

    def close(self) -> None:
        """Give everything back."""
        return


class AskingPort(Port):
    """A port that can also ask, and is told how the run ends."""

    def ask(self, number: int, name: str, values: Mapping[str, Shown]) -> None:
        """Send the request of this name, with the values of its fields; it is to be answered by its number."""
        raise NotImplementedError

    def cancel(self, number: int) -> None:
        """The answer to a request is not wanted any more."""
        raise NotImplementedError

    def safe(self, values: Mapping[str, Shown]) -> None:
        """The run has ended, and these are safe values of its outputs, by field."""
        raise NotImplementedError

    def end(self, ending: str) -> None:
        """Nothing more is sent. The port is `flushed` when the other side has gone as well."""
        raise NotImplementedError


Opener = Callable[[Link], Port]
"""Opens a port. Unopened; ModuleNotFoundError: a package is not installed."""


@dataclass(frozen=True, slots=True)
class PortSpec:
    """A port as it is declared."""

    name: str
    start: Opener
    inputs: Mapping[str, str] = field(default_factory=dict)
    """The field that feeds each input, by the input."""
    outputs: Mapping[str, str] = field(default_factory=dict)
    """The field that shows each slot, by the slot."""
    on_failure: OnFailure = "stale"
    timeout: float | None = None
    """Seconds after which an input without a message has failed; None: only what is lost has."""
    safe: Mapping[str, str] = field(default_factory=dict)
    """Safe values of inputs and slots, as they are written."""
    holds: tuple[str, ...] = ()
    """What no other port of the run can have."""
    span: Span | None = None
    paces: bool = False
    """Cycles begin when this port says so, and it is sent the frame at the end of each."""
    values: Mapping[str, str] = field(default_factory=dict)
    """Texts of the other side, and what they are called here."""
    events: Mapping[str, str] = field(default_factory=dict)
    """Inputs that have the value of a message for one cycle, and then this value of rest."""
    when: str | None = None
    """The slot by whose change a message goes out; None: any output."""
    requests: tuple[Request, ...] = ()
    never: frozenset[str] = frozenset()
    """Those of the inputs that never change: their values are read before the run."""

    @property
    def fed(self) -> frozenset[str]:
        """All inputs to which it gives values."""
        return frozenset((*self.inputs, *(name for request in self.requests for name in request.fed)))

    @property
    def shown(self) -> frozenset[str]:
        """All slots that it reads in frames."""
        asked = (name for request in self.requests for name in (request.ask, request.state, *request.sends))
        return frozenset((*self.outputs, *([] if self.when is None else [self.when]), *asked))


@dataclass(frozen=True, slots=True)
class Started:
    """What a kind makes of its settings."""

    start: Opener
    holds: tuple[str, ...] = ()
    """What no other port of the run can have, such as ``standard input``, in words."""
    paces: bool = False
    """As of `PortSpec`."""


class Kind(Protocol):
    """A kind of port, as the registry has it. One that has its settings in a `table` is in `llfsm schema ports` as
    well (`yaml/tables.py`).
    """

    keys: tuple[str, ...]
    """Of its settings, beside those that every port has."""
    required: tuple[str, ...]
    paths: bool = False
    """Whether dots in fields lead into messages, as in lines of JSON."""
    requests: Table | None = None
    """What each of its `requests` has beside what all have, such as the name of a service; the child is told it. None:
    its ports are no `AskingPort`, so it has no requests, and reads no values before the run."""
    no_requests: str = ""
    """Why it has none, where users may expect them."""

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """Reads the settings of a port, `what` in messages; None: something is wrong and was reported.

        `folder`: that of the file, in which paths begin.
        """

    def field_problem(self, name: str, *, output: bool) -> str | None:  # noqa: ARG002 - any name fits most kinds
        """Why there can be no field of this name."""
        return None


PORTS: Registry[Kind] = Registry(
    "kind of port",
    [
        Entry("callback", "llfsm_verify.runtime.ports.callback:KIND", "a function in Python"),
        Entry("process", "llfsm_verify.runtime.ports.process.kind:KIND", "a program, which speaks lines of JSON"),
        Entry("stream", "llfsm_verify.runtime.ports.stream:KIND", "a pipe, a descriptor or a standard stream"),
        Entry("whiteboard", "llfsm_verify.runtime.ports.whiteboard:KIND", "slots of another run"),
    ],
    "llfsm_verify.ports",
)


def whole_number(report: Report, found: Mapping[str, Node], key: str, low: int, high: int, default: int) -> int | None:
    """The number under a key, or the default where the key is missing; None: it is wrong, which was reported."""
    if key not in found:
        return default
    scalar = report.scalar(found[key], f"`{key}`")
    if scalar is None:
        return None
    text = scalar.text
    if text.isascii() and text.isdigit() and len(text) <= 9 and low <= int(text) <= high:
        return int(text)
    message = f"`{key}` cannot be `{text[:40]}`"
    report.error(UNKNOWN, message, mark(scalar), f"write a whole number from {low} to {high}")
    return None
