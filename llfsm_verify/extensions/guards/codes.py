"""The codes of what cannot be guarded."""

from __future__ import annotations

from typing import Final

NOT_GUARDABLE: Final = "E437"
UNFIT: Final = "E438"
UNKNOWN_NAME: Final = "E439"
UNWRITABLE: Final = "E440"

CODES: Final[dict[str, str]] = {
    NOT_GUARDABLE: "A property that no guard can keep.",
    UNFIT: "An arrangement, a machine, an output, an assumption or a reaction that a guard cannot take as it is.",
    UNKNOWN_NAME: "A guard is to route, guard or command something that is not in the arrangement.",
    UNWRITABLE: "The files of a guarded arrangement cannot be written there, or would replace others.",
}
