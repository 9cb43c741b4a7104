"""What a language server itself has to say of files."""

from __future__ import annotations

from typing import Final

NO_ARRANGEMENT: Final = "E560"
ALONE: Final = "E561"
TOO_LONG: Final = "E562"
CODES: Final = {
    NO_ARRANGEMENT: "An editor shows a file of properties or ports, and nothing says of which arrangement it is.",
    ALONE: "An editor shows a machine or a policy that no arrangement names.",
    TOO_LONG: "What an editor shows takes too long to read, so what is said of it may be old.",
}
