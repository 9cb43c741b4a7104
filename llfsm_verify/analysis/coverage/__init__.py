"""What runs cover of an arrangement, and short runs that cover what can be covered."""

from typing import Final

OTHER: Final = "E520"
UNCOUNTED: Final = "E521"
BAD_VECTORS: Final = "E522"
UNWRITABLE: Final = "E523"

CODES: Final = {
    OTHER: "A run is of another arrangement than the one whose coverage is asked for.",
    UNCOUNTED: "A run cannot be counted for coverage.",
    BAD_VECTORS: "A file is not one of test vectors, or is damaged.",
    UNWRITABLE: "Test vectors cannot be written there, or would replace a file that is an input.",
}
