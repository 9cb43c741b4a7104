"""The codes of what cannot be written of a monitor."""

from __future__ import annotations

from typing import Final

from llfsm_verify.diagnostics import Codes

CODES: Final = Codes()

UNREADABLE: Final = CODES.add("E430", "A machine cannot read what an atom asks for.")
UNTYPED: Final = CODES.add("E431", "The type of a variable in an atom is not known without the arrangement.")
NOT_MONITORABLE: Final = CODES.add("E432", "No word gives a verdict on a property, so there is no monitor of it.")
TOO_LARGE: Final = CODES.add("E433", "A monitor is too large for a machine.")
UNWRITABLE: Final = CODES.add("E434", "A monitor cannot be written there.")
UNKNOWN_NAME: Final = CODES.add(
    "E435", "A monitor is to set or suspend something that is not in the arrangement, or is not a name."
)
NEVER_VIOLATED: Final = CODES.add("E436", "A monitor should act on a violation, but no word violates the property.")
NOT_THERE: Final = CODES.add(
    "W003", "A property to watch at run time speaks of the model of the surroundings, which does not run then."
)
