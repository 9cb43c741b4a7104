"""A command that makes the program say why it cannot listen."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

NOT_HERE = "192.0.2.1"
"""An address of documentation, which no computer has."""
PROVOKED = {
    "E550": Provoked(
        (f"llfsm monitor 'G !m@ON' --arrangement a.yaml --mapping m.yaml --serve 8080 --host {NOT_HERE}",),
        LAMP | {"m.yaml": "columns: {m: lamp}\n"},
    ),
}
