"""Automata in the Hanoi Omega-Automata format, which Spot, Owl and other tools write and read."""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.automata": (
        Entry("hoa", f"{__name__}.format:HOA", "the Hanoi Omega-Automata format, version 1", (".hoa",)),
    ),
}
