"""What can be wrong with a cluster."""

from __future__ import annotations

from typing import Final

ABSENT: Final = "E600"
IDLE: Final = "E601"
OTHER: Final = "E602"
GONE: Final = "E603"
ADDRESS: Final = "E604"
CODES: Final = {
    ABSENT: "No scheduler answers at an address.",
    IDLE: "A scheduler has no workers.",
    OTHER: "A worker has other versions than we have, or cannot perform our tasks.",
    GONE: "The connection to a scheduler was lost, or our tasks were cancelled there.",
    ADDRESS: "This is not the address of a scheduler.",
}
