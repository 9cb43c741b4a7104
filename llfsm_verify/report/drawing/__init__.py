"""Drawings of machines and arrangements: one neutral graph, a writer for each format."""

from typing import Final

NO_LIBRARY: Final = "E406"
UNWRITABLE: Final = "E407"

CODES: Final[dict[str, str]] = {
    NO_LIBRARY: "Drawings as SVG and PNG need the package pygraphviz.",
    UNWRITABLE: "A drawing cannot be written there.",
}
