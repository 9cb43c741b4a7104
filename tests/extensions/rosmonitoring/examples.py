"""A command that makes the program say why it cannot listen."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

DOOR = """\
name: door
cycle_ms: 100
whiteboard:
  open: {type: bool, role: input}
  speed: {type: 0..9, role: input}
machines: {m: {inline: {machine: M, states: [{name: A, stays: true}]}}}
schedule: [m]
"""
"""An arrangement for logs of two topics."""
NOT_HERE = "192.0.2.1"
"""An address of documentation, which no computer has."""
PROVOKED = {
    "E550": Provoked(
        (f"llfsm monitor 'G !m@ON' --arrangement a.yaml --mapping m.yaml --serve 8080 --host {NOT_HERE}",),
        LAMP | {"m.yaml": "columns: {m: lamp}\n"},
    ),
}
