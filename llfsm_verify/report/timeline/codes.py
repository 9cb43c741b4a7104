"""The diagnostic codes of timelines."""

from __future__ import annotations

CODES = {"E487": "A timeline cannot be written there."}
UNWRITABLE = "E487"
