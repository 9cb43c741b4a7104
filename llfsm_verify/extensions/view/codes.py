"""What can be wrong with what is to be shown."""

from __future__ import annotations

from typing import Final

ABSENT: Final = "E551"
OTHER: Final = "E552"
UNWRITTEN: Final = "E553"
DEAF: Final = "E554"
WINDOW: Final = "E555"
CODES: Final = {
    ABSENT: "There is no such run to show, or the file has none.",
    OTHER: "The run that is to be shown is not one of this arrangement.",
    UNWRITTEN: "A run that goes on is not written to a file.",
    DEAF: "A page cannot be served on a port.",
    WINDOW: "A run has no such steps to show.",
}
