"""Values and signals as the document has them."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import Any

from llfsm_verify.plug import BoardSlot, Shown, Signal, text

MOST_EXACT = 1 << 53
"""Doubles have all whole numbers up to it."""
FEW = 8
"""So many different numbers are boxes with their texts; more are a curve."""
Exact = bool | int | str


def exact(value: Shown) -> Exact:
    """A value as the document has it: a text where a double would not hold all of its digits."""
    if isinstance(value, Decimal) or (type(value) is int and abs(value) >= MOST_EXACT):
        return text(value)
    return value


def group_of(signal: BoardSlot | Signal) -> str:
    """What the signal stands with."""
    if signal.kind == "machine":
        return signal.name.partition(".")[0]
    return {"state": "states", "input": "inputs", "verdict": "verdicts"}.get(signal.kind, signal.kind)


def signal_of(slot: BoardSlot) -> dict[str, Any]:
    found = {"name": slot.name, "kind": slot.kind, "group": group_of(slot)}
    if slot.labels:
        return found | {"draw": "boxes", "labels": list(dict.fromkeys(slot.labels))}
    if slot.boolean:
        return found | {"draw": "levels"}
    low, high = (
        exact(Decimal(bound).scaleb(-slot.digits) if slot.digits else bound) for bound in (slot.low, slot.high)
    )
    return found | {"draw": "curve", "low": low, "high": high}


def drawn_as_shown(signals: list[dict[str, Any]], runs: list[dict[str, Any]]) -> None:
    """Let numbers be drawn as `llfsm trace --to svg` draws them: few as boxes, others between the least and the
    greatest that there is, since the range of a type may be much wider."""
    for number, signal in enumerate(signals):
        if signal["draw"] == "curve" and runs:
            values = {Decimal(value) for run in runs for value in run["changes"][number]["values"]}
            signal |= {"low": exact(_least(values)), "high": exact(_least(values, max))}
            if len(values) <= FEW:
                signal["draw"] = "boxes"


def _least(values: set[Decimal], of: Callable[[set[Decimal]], Decimal] = min) -> int | Decimal:
    found = of(values)
    return int(found) if found == found.to_integral_value() else found
