"""The kinds of ports, by the names that files of ports know them by."""

from __future__ import annotations

from llfsm_verify.registry import Entry, Registry
from llfsm_verify.runtime.ports.port import Kind

PORTS: Registry[Kind] = Registry(
    "kind of port",
    [
        Entry("callback", "llfsm_verify.runtime.ports.callback:KIND", "a function in Python"),
        Entry("stream", "llfsm_verify.runtime.ports.stream:KIND", "a pipe, a descriptor or a standard stream"),
        Entry("whiteboard", "llfsm_verify.runtime.ports.whiteboard:KIND", "slots of another run"),
    ],
    "llfsm_verify.ports",
)
