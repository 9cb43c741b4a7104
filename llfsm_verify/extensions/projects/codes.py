"""What can be wrong with a new project."""

from __future__ import annotations

from typing import Final

OVERWRITTEN: Final = "E460"
MISNAMED: Final = "E461"
UNWRITABLE: Final = "E462"
CODES: Final = {
    OVERWRITTEN: "A new project would overwrite files.",
    MISNAMED: "The name of a new project is not a valid name.",
    UNWRITABLE: "A new project cannot be written there.",
}
