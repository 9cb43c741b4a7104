"""What programs store in cells, as texts."""

from __future__ import annotations

import math
from datetime import date, time
from decimal import Decimal


def cell_text(value: object) -> str | None:
    """The text of a value, as properties write values; None: there is nothing that one could write."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | str):
        return str(value).strip() or None
    if isinstance(value, float):
        return f"{Decimal(repr(value)):f}" if math.isfinite(value) else None
    if isinstance(value, Decimal):
        return f"{value:f}" if value.is_finite() else None
    if isinstance(value, date | time):
        return value.isoformat()
    return None
