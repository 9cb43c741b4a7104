"""What can be wrong with an image for a microcontroller."""

from __future__ import annotations

from typing import Final

WRONG_PINS: Final = "E506"
WRONG_TICK: Final = "E507"
CODES: Final = {
    WRONG_PINS: "A table of pins does not fit the arrangement or the microcontroller.",
    WRONG_TICK: "The timer of a microcontroller cannot make the cycle of the arrangement.",
}
