"""The diagnostics of drawings: each code with its meaning in a line."""

from __future__ import annotations

from typing import Final

NO_LIBRARY: Final = "E406"
UNWRITABLE: Final = "E407"

CODES: Final[dict[str, str]] = {
    NO_LIBRARY: "Drawings as SVG and PNG need the package pygraphviz.",
    UNWRITABLE: "A drawing cannot be written there.",
}
