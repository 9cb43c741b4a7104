"""Times as people write them."""

from __future__ import annotations

import re
from fractions import Fraction

UNITS = {"ms": Fraction(1), "s": Fraction(1000), "min": Fraction(60_000), "h": Fraction(3_600_000)}
MOST_MS = 10**12


def duration_ms(text: str) -> Fraction | None:
    """A positive time in milliseconds; a number without a unit is one of them. None: the text is no such time."""
    value = _milliseconds(text)
    return value if value is not None and 0 < value <= MOST_MS else None


def excess(text: str) -> str | None:
    """What is said of a time that is longer than the longest that is taken; None: it is no such time."""
    value = _milliseconds(text)
    if value is None or value <= MOST_MS:
        return None
    return f"`{text[:40]}` is longer than the longest time, {MOST_MS // 1000:,} s"


def _milliseconds(text: str) -> Fraction | None:
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz")
    if re.fullmatch(r"[0-9.]{1,300}(e[+-]?[0-9]{1,2})?", number, re.ASCII) is None:
        return None  # a larger exponent takes long to calculate with
    try:
        return Fraction(number) * UNITS[text[len(number) :] or "ms"]
    except (ValueError, KeyError):
        return None
