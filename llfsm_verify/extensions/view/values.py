"""Values and signals as the document has them."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

from llfsm_verify.plug import BoardSlot, Shown, text

MOST_EXACT = 1 << 53
"""Doubles have all whole numbers up to it."""
Exact = bool | int | str


def exact(value: Shown) -> Exact:
    """A value as the document has it: a text where a double would not hold all of its digits."""
    if isinstance(value, Decimal) or (type(value) is int and abs(value) >= MOST_EXACT):
        return text(value)
    return value


def signal_of(slot: BoardSlot) -> dict[str, Any]:
    group = {"state": "states", "input": "inputs", "verdict": "verdicts"}.get(slot.kind, slot.kind)
    if slot.kind == "machine":
        group = slot.name.partition(".")[0]
    found = {"name": slot.name, "kind": slot.kind, "group": group}
    if slot.labels:
        return found | {"draw": "boxes", "labels": list(dict.fromkeys(slot.labels))}
    if slot.boolean:
        return found | {"draw": "levels"}
    low, high = (
        exact(Decimal(bound).scaleb(-slot.digits) if slot.digits else bound) for bound in (slot.low, slot.high)
    )
    return found | {"draw": "curve", "low": low, "high": high}
