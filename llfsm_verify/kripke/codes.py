"""The diagnostic codes of Kripke structures and of models for other checkers, with what each means."""

from __future__ import annotations

CODES: dict[str, str] = {
    "E420": "A value of type `int` in a model for a checker that has no such integers.",
    "E421": "A value that a model for another checker cannot hold in 32 bits.",
    "E422": "A structure or model cannot be written there.",
    "E423": "A graph of networkx needs the package networkx.",
    "E424": "A property is too large for a model of SPIN (its automaton) or SMV (its text).",
}
