"""Commands that make the program say what is wrong with a new project."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

PROVOKED = {
    "E460": Provoked(
        ("llfsm init crossing", "llfsm init crossing"),
    ),
    "E461": Provoked(("llfsm init crossing --name 'my crossing'",)),
    "E462": Provoked(("llfsm init a.yaml/crossing",), LAMP),
}
