"""Times as people write them."""

from __future__ import annotations

from fractions import Fraction

UNITS = {"ms": Fraction(1), "s": Fraction(1000), "min": Fraction(60_000), "h": Fraction(3_600_000)}
MOST_MS = 10**12


def duration_ms(text: str) -> Fraction | None:
    """A positive time in milliseconds; a number without a unit is one of them. None: the text is no such time."""
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = text[len(number) :] or "ms"
    try:
        value = Fraction(number) * UNITS[unit] if len(number) <= 20 and "/" not in number else Fraction(0)
    except (ValueError, KeyError):
        return None
    return value if 0 < value <= MOST_MS else None
