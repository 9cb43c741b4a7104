"""What models for other checkers cannot hold."""

from __future__ import annotations

from typing import Final

CODES: Final = {
    "E420": "A value of type `int` in a model for a checker that has no such integers.",
    "E421": "A value that a model for another checker cannot hold in 32 bits.",
    "E424": "A property is too large for a model of SPIN (its automaton) or SMV (its text).",
}
