"""What can be wrong with an oracle."""

from __future__ import annotations

from typing import Final

DEAF: Final = "E550"
CODES: Final = {DEAF: "A server of verdicts cannot listen at an address."}
