"""The diagnostics of tests that run arrangements at random: each code with its meaning."""

from __future__ import annotations

from typing import Final

UNTESTED: Final = "E470"
PARTLY: Final = "E471"

CODES: Final = {
    UNTESTED: "A strict test has a property that no finite run can violate, or whose monitor was not made.",
    PARTLY: "A strict test has a property that is tested in part only: no finite part of some runs violates it.",
}
