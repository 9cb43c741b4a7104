"""What shapes.js makes, said once more in Python: stretches of values in pixels, and ticks."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from typing import Any

NARROW, APART = 3, 90
"""Pixels: of a stretch that is drawn as one with its neighbours, and between two ticks."""


def shapes(document: Any, run: Any, first: int, last: int, width: float) -> dict[str, Any]:
    step = width / (last - first + 1)
    pairs = zip(document["signals"], run["changes"], strict=True)
    lanes = [_stretches(signal, change, first, last, step) for signal, change in pairs]
    return {
        "lanes": lanes,
        "ticks": _ticks(run["rows"], first, last, step, document.get("arrangement", {}).get("cycle_ms")),
    }


def _tenths(pixels: float) -> float:
    return math.floor(pixels * 10 + 0.5) / 10


def _stretches(signal: Any, change: Any, first: int, last: int, step: float) -> list[dict[str, Any]]:
    at, values = change["at"], change["values"]
    found: list[dict[str, Any]] = []
    since: int | None = None
    for i in range(max(0, bisect_right(at, first) - 1), bisect_right(at, last)):
        begin, end = max(at[i], first), min(at[i + 1] if i + 1 < len(at) else last + 1, last + 1)
        narrow = (end - begin) * step < NARROW
        heights = [] if signal["draw"] == "boxes" else [_height(signal, values[i])]
        if since is not None and narrow and (begin - since) * step < NARROW:
            found[-1] |= {"end": _tenths((end - first) * step), "value": None}
            if heights:
                found[-1] |= {"low": min(found[-1]["low"], *heights), "high": max(found[-1]["high"], *heights)}
            continue
        one = {"begin": _tenths((begin - first) * step), "end": _tenths((end - first) * step), "value": values[i]}
        found.append(one | {key: height for height in heights for key in ("low", "high")})
        since = begin if narrow else None
    return found


def _height(signal: Any, value: Any) -> float:
    if signal["draw"] == "levels":
        return 1 if value is True or value == 1 else 0
    low, high = float(signal["low"]), float(signal["high"])
    return math.floor((float(value) - low) / (high - low) * 1000 + 0.5) / 1000 if high > low else 0.5


def _ticks(rows: Any, first: int, last: int, step: float, period: float | None) -> list[dict[str, Any]]:
    """Where cycles begin at round times, or, without times, where cycles of round numbers begin."""
    cycle, times = rows["cycle"], rows["time_ms"]
    if times is None:
        period = None
    zero = cycle[last] - math.floor(times[last] / period + 0.5) if period else 0
    apart = _cycles_apart((cycle[last] - cycle[first]) * APART / ((last - first + 1) * step), period)
    ticks: list[dict[str, Any]] = []
    for number in range(max(0, math.ceil((cycle[first] - zero) / apart) * apart), cycle[last] - zero + 1, apart):
        row = bisect_left(cycle, number + zero)
        x = _tenths((row - first) * step)
        if cycle[row] == number + zero and row >= first and not (ticks and x - ticks[-1]["x"] < APART / 2):
            ticks.append({"x": x, "text": f"cycle {number}" if times is None else _time(times[row])})
    return ticks


def _cycles_apart(wanted: float, period: float | None) -> int:
    """At least so many cycles between ticks: those of a round time if they are whole, else a round number of them."""
    usual = _round_up(wanted)
    if period:
        time = _round_up(wanted * period)
        while time <= 5 * usual * period:
            cycles = math.floor(time / period + 0.5)
            if cycles >= 1 and abs(time / period - cycles) < 1e-9:
                return cycles
            time = _round_up(time * 1.5)
    return usual


def _round_up(wanted: float) -> int:
    found: int = next(part * 10**power for power in range(40) for part in (1, 2, 5) if part * 10**power >= wanted)
    return found


def _time(time: float) -> str:
    seconds = abs(time) >= 1000 or time == 0
    number = f"{time / 1000:.6f}" if seconds else f"{time:.3f}"
    return f"{number.rstrip('0').rstrip('.')} {'s' if seconds else 'ms'}"
