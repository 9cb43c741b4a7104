"""The kinds of ports, by the names that files of ports know them by.

Kinds of other packages are found by the entry point group `llfsm_verify.ports`; each is an `Entry` whose place has a
`port.Kind`.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry, add_others
from llfsm_verify.runtime.ports.port import Kind

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "llfsm_verify.ports"
PORTS: Registry[Kind] = Registry(
    "kind of port",
    [
        Entry("callback", "llfsm_verify.runtime.ports.callback:KIND", "a function in Python"),
        Entry("stream", "llfsm_verify.runtime.ports.stream:KIND", "a pipe, a descriptor or a standard stream"),
        Entry("serial", "llfsm_verify.runtime.ports.serial_line:KIND", "a serial line"),
        Entry("mqtt", "llfsm_verify.runtime.ports.mqtt_kind:KIND", "topics of an MQTT broker"),
        Entry("whiteboard", "llfsm_verify.runtime.ports.whiteboard:KIND", "slots of another run"),
    ],
)


def kind_named(name: str) -> tuple[Kind | None, list[str]]:
    """The kind of that name; None: there is none, and sentences about those of other packages that cannot be used."""
    broken = [] if name in PORTS else _others()
    return (PORTS.load(name) if name in PORTS else None), broken


@cache
def _others() -> list[str]:
    return add_others(PORTS, GROUP, _entry_at)


def _entry_at(point: EntryPoint) -> Entry:
    entry = point.load()
    if not isinstance(entry, Entry):
        raise TypeError(f"{point.value} is not an Entry")
    return entry
