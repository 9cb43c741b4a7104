"""What can be wrong with a sweep."""

from __future__ import annotations

from typing import Final

NO_FILE: Final = "E590"
NO_NAME: Final = "E591"
TOO_MANY: Final = "E592"
TWICE: Final = "E593"
WRONG_RANGE: Final = "E594"
WRONG_EXCLUSION: Final = "E595"
WRONG_RESULTS: Final = "E596"
WRONG_OPTION: Final = "E597"
NO_PROCESS: Final = "E598"
IDLE_EXCLUSION: Final = "W590"
DAMAGED_ROW: Final = "W591"
OTHER_ROWS: Final = "W592"
NO_PROPERTIES: Final = "W593"
CODES: Final = {
    NO_FILE: "A pattern in a sweep matches no file.",
    NO_NAME: "A sweep gives a value to something that one of its arrangements does not have.",
    TOO_MANY: "A sweep has more combinations than are taken.",
    TWICE: "Two combinations of a sweep are the same.",
    WRONG_RANGE: "A range of a sweep has no values, or is not one of numbers.",
    WRONG_EXCLUSION: "A sweep excludes values of something that it does not vary, or all combinations.",
    WRONG_RESULTS: "A file is not one of results of this sweep, or cannot be written there.",
    WRONG_OPTION: "An option of a sweep has a wrong value.",
    NO_PROCESS: "The system does not let a sweep start processes.",
    IDLE_EXCLUSION: "An exclusion of a sweep excludes no combination.",
    DAMAGED_ROW: "A line of a file of results cannot be read, and its combination is checked again.",
    OTHER_ROWS: "A file of results has rows of other combinations, which are kept.",
    NO_PROPERTIES: "A sweep names no property files, and none stands beside an arrangement.",
}
