"""The diagnostic codes of transition files and of state machines that run by them, with what each means."""

from __future__ import annotations

from typing import Final

CODES: Final = {
    "E544": "A transition file that has no states, a state without transitions, or a label twice.",
    "E545": "A transition leads to what is neither a label nor an outcome of the state machine.",
    "E546": "A state may give an outcome for which it has no transition.",
    "E547": "A label has no state in Python, or there is no such label in the transition file.",
    "E548": "From a state, no outcome of the state machine can be reached.",
    "E549": "A state in Python does not declare its outcomes, or not as texts.",
    "W544": "A transition leads to what is taken for an outcome, and resembles a label.",
}
SHAPE: Final = "E544"
TARGET: Final = "E545"
UNMAPPED: Final = "E546"
LABEL: Final = "E547"
ENDLESS: Final = "E548"
UNDECLARED: Final = "E549"
NEAR: Final = "W544"
