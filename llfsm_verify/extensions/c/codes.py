"""What can be wrong with an arrangement as C, and with a built image."""

from __future__ import annotations

from typing import Final

SAME_NAME: Final = "E504"
LEAVES_64: Final = "E517"
OF_C: Final = "E525"
MISSING: Final = "E508"
FAILED: Final = "E509"
CODES: Final = {
    SAME_NAME: "Two names are one in the language of a target.",
    LEAVES_64: "What a property calculates may leave 64 bits, which a monitor of a target cannot say.",
    OF_C: "The name of an arrangement is one that the language of a target has.",
    MISSING: "A compiler or an emulator that a verified build needs is not installed.",
    FAILED: "A built image cannot be verified: it does not compile or fit, it gives no answer, or its vectors are of "
    "another program.",
}
