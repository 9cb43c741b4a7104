"""A command that makes the program say what is wrong with a term of a port of Prolog."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

PORTS = """\
ports:
  reasoner:
    kind: prolog
    file: lamp.pl
    inputs: {go: "may_go(, now)"}
    on_failure: stale
"""
FILES = LAMP | {"reasoner.ports.yaml": PORTS, "lamp.pl": "may_go(_, now).\n"}
PROVOKED = {"E581": Provoked(("llfsm run a.yaml --ports reasoner.ports.yaml",), FILES)}
