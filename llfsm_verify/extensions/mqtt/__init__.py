"""Ports that are topics of an MQTT broker."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.ports": (
        Entry(
            "mqtt", f"{__name__}.kind:KIND", "topics of an MQTT broker", package=Package("paho", "paho-mqtt", "mqtt")
        ),
    ),
}
