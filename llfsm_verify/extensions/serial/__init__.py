"""Ports that are serial lines."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.ports": (
        Entry("serial", f"{__name__}.kind:KIND", "a serial line", package=Package("serial", "pyserial", "serial")),
    ),
}
