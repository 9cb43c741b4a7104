"""The suite for kinds of ports: what they declare, their settings, and that an open port never waits."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import TypeVar, cast

from llfsm_verify.diagnostics import Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.registry import Entry
from llfsm_verify.runtime.ports.file import PORT
from llfsm_verify.runtime.ports.port import PORTS, AskingPort, Kind, Port, Started
from llfsm_verify.testing.conformance.outcome import Case, Wrong
from llfsm_verify.testing.conformance.plugs import ODD, demand, entry_of
from llfsm_verify.testing.conformance.stopping import Overdue, within_time
from llfsm_verify.values import Shown
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping as MappingNode
from llfsm_verify.yaml.nodes import Node, Scalar

T = TypeVar("T")
AT_ONCE = 5.0
"""A call that does not wait ends within so many seconds, even on a busy machine."""
WRONG = ("{}", "[a]", "''", "-1", "x" * 300)
"""Values that most settings cannot have."""


class _Heard:
    """A link whose run takes whatever comes."""

    name = "port"

    def __init__(self, inputs: Iterable[str] = ("go",), outputs: Iterable[str] = ("out",)) -> None:
        self.fields, self._outputs = frozenset(inputs), frozenset(outputs)

    latest, repeats = 1, True

    def hello(self, told: Mapping[str, Json]) -> dict[str, Json]:
        number: Json = {"low": 0, "high": 1, "boolean": True, "digits": 0, "labels": []}
        return {
            "hello": 1, "port": self.name, "cycle_ms": 10.0, "inputs": dict.fromkeys(self.fields, number),
            "outputs": dict.fromkeys(self._outputs, number),
            "requests": {}, "told": dict(told),
        }  # fmt: skip

    def take(self, values: Mapping[str, Json]) -> None:
        demand(isinstance(values, Mapping), "a message is not a mapping")

    def malformed(self, why: str) -> None:
        demand(why, "what is wrong with a message is not said")

    def lost(self, why: str, *, forever: bool = False, fields: Collection[str] | None = None) -> None:  # noqa: ARG002 - as a link has it
        demand(why, "why the other side is lost is not said")

    def report(self, number: int, state: str, values: Mapping[str, Json], *, end: bool) -> None:  # noqa: ARG002 - as a link has it
        demand(number > 0, "what is reported has no number")

    def fail_requests(self, why: str) -> None:
        demand(why, "why requests have failed is not said")

    def say(self, what: str) -> None:
        demand(what, "nothing is said")

    def cycle(self, number: int, values: Mapping[str, Json]) -> None:
        demand(number >= 0 and isinstance(values, Mapping), "a cycle has a number and values")

    def sent(self) -> None: ...

    def unsent(self, why: str) -> None:
        demand(why, "why a message was not sent is not said")


def _heard(settings: Mapping[str, Node]) -> _Heard:
    """With the fields that the settings name, where they do."""
    named = {
        key: [value.text for _, value in node.items if isinstance(value, Scalar)]
        for key in ("inputs", "outputs")
        if isinstance(node := settings.get(key), MappingNode)
    }
    return _Heard(**named)


def port_cases(kind: Entry | str, settings: str, folder: str | Path = ".") -> list[Case]:
    """Of a kind of port. `settings`: a mapping in YAML with which a port can be opened again and again, where paths
    begin in `folder`. Unregistered."""
    entry = entry_of(kind, PORTS)

    def of() -> Kind:
        return cast(Kind, entry.load())

    def given() -> dict[str, Node]:
        root = compose(Source("ports.yaml", settings), [])
        assert isinstance(root, MappingNode), "settings are a mapping"
        return {key.text: node for key, node in root.items}

    def settled(found: Mapping[str, Node]) -> Started | None:
        report = Report()
        started = of().settings(report, found, "port `a`", str(folder))
        demand((started is None) == bool(report.diagnostics), "it reports a mistake and starts, or does neither")
        return started

    def declares() -> None:
        keys, common = set(of().keys), set(PORT.keys)
        demand(set(of().required) <= keys | common, "it requires a key that it does not have")
        demand(not keys & common, "one of its keys is one that every port has")
        demand(set(given()) <= keys | common, "the settings have a key that it does not name")
        for name in ("", "a", ODD, "x" * 100_000):
            for output in (False, True):
                problem = of().field_problem(name, output=output)
                demand(problem is None or problem, "why there can be no field is not said")

    def settles() -> None:
        demand(settled(given()) is not None, "it does not take the settings")
        for key in set(given()) & set(of().keys):
            for wrong in WRONG:
                settled({**given(), key: compose(Source("ports.yaml", wrong), [])})

    def opens() -> None:
        started = settled(given())
        if started is None:
            raise Wrong("it does not take the settings")
        before = _descriptors()
        for _ in range(2):
            port = _at_once("opening", lambda: started.start(_heard(given())))
            try:
                _serve(port)
                if isinstance(port, AskingPort):
                    _leave(port)
            finally:
                _at_once("`close`", port.close)
            demand(_descriptors() <= before, "a port that is closed leaves a descriptor open")

    return [
        Case("declares", "keys and fields", declares),
        Case("settings", "right and wrong settings", settles),
        Case("opens", "a port is opened, served and closed, and no call waits", opens),
    ]


def _serve(port: Port) -> None:
    """As a run does, with values that change."""
    demand(isinstance(port.every_frame, bool), "`every_frame` is neither true nor false")
    for number in range(20):
        values: dict[str, Shown] = {"out": number, "on": number % 2 == 0, "speed": Decimal("0.5"), "mode": "LOW"}
        _at_once("`send`", partial(port.send, values))
        _turn(port)
        demand(isinstance(port.flushed, bool), "`flushed` is neither true nor false")


def _leave(port: AskingPort) -> None:
    """As a run does that asks, cancels, and ends; then the other side must end."""
    values: dict[str, Shown] = {"on": True}
    for what, call in (
        ("ask", partial(port.ask, 1, "request", values)), ("cancel", partial(port.cancel, 1)),
        ("safe", partial(port.safe, values)), ("end", partial(port.end, "stopped")),
    ):  # fmt: skip
        _at_once(f"`{what}`", call)
    limit = time.monotonic() + 2 * AT_ONCE
    while not port.flushed:
        demand(time.monotonic() < limit, "it is not `flushed` although it was told the end")
        _turn(port)


def _turn(port: Port) -> None:
    poll = select.poll()
    for descriptor, events in port.waits():
        poll.register(descriptor, events)
    _at_once("`serve`", partial(port.serve, dict(poll.poll(1)), time.monotonic()))


def _at_once(what: str, call: Callable[[], T]) -> T:
    """What a call gives. Wrong: it waits for something."""
    try:
        with within_time(AT_ONCE):
            return call()
    except Overdue:
        raise Wrong(f"{what} waits, and no call may") from None


def _descriptors() -> frozenset[str]:
    return frozenset(path.name for path in Path("/proc/self/fd").iterdir())
