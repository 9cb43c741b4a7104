"""The codes of what cannot be written of a monitor."""

from __future__ import annotations

from typing import Final

UNREADABLE: Final = "E430"
UNTYPED: Final = "E431"
NOT_MONITORABLE: Final = "E432"
TOO_LARGE: Final = "E433"
UNWRITABLE: Final = "E434"
UNKNOWN_NAME: Final = "E435"
NEVER_VIOLATED: Final = "E436"
NOT_THERE: Final = "W003"

CODES: Final[dict[str, str]] = {
    UNREADABLE: "A machine cannot read what an atom asks for.",
    UNTYPED: "The type of a variable in an atom is not known without the arrangement.",
    NOT_MONITORABLE: "No word gives a verdict on a property, so there is no monitor of it.",
    TOO_LARGE: "A monitor is too large for a machine.",
    UNWRITABLE: "A monitor cannot be written there.",
    UNKNOWN_NAME: "A monitor is to set or suspend something that is not in the arrangement, or is not a name.",
    NEVER_VIOLATED: "A monitor should act on a violation, but no word violates the property.",
    NOT_THERE: "A property to watch at run time speaks of the model of the surroundings, which does not run then.",
}
