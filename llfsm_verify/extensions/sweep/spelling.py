"""Values of a sweep as people write them, and as JSON: one value for all spellings of a number."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

from llfsm_verify.plug import Json, duration_ms

_INTEGER = re.compile(r"[+-]?(?:0x[0-9a-fA-F]{1,16}|0|[1-9][0-9]{0,18})\Z", re.ASCII)
_DECIMAL = re.compile(r"[+-]?[0-9]{1,12}\.[0-9]{1,12}\Z", re.ASCII)


def read_value(text: str) -> Json:
    """A value as JSON: the same one for all spellings of a number; other words, such as enumerators, are texts."""
    stripped = text.strip()
    if _INTEGER.match(stripped):
        return int(stripped, 0)
    if _DECIMAL.match(stripped):
        return number(Fraction(stripped))
    return {"true": True, "false": False}.get(stripped, stripped)


def read_timeout(text: str) -> float:
    """Seconds: a number of them, or a time with its unit. ValueError."""
    together = re.sub(r"(?<=[0-9.])\s+(?=[a-z])", "", text.strip())
    time = duration_ms(f"{together}s" if together[-1:].isdigit() else together)
    if time is None:
        raise ValueError(f"`{text[:40]}` is not a positive time such as 10 s, 500 ms or 5 min")
    return float(time / 1000)


def number(value: Fraction) -> Json:
    """A number as JSON, exactly."""
    if value.denominator == 1:
        return int(value)
    text = f"{Decimal(value.numerator) / Decimal(value.denominator):f}"
    return float(text) if repr(float(text)) == text else text


def words(value: Json) -> str:
    """A value as one would write it; equal values have equal texts."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(words, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {words(each)}' for key, each in sorted(value.items()))}}}"
    return str(value)
