"""Timelines as value change dumps (IEEE 1364), which GTKWave and other viewers of waveforms read."""

from __future__ import annotations

import io
from decimal import Decimal
from typing import TYPE_CHECKING, Any, BinaryIO

from llfsm_verify.plug import Shown, Signal, Timeline

if TYPE_CHECKING:
    from vcd import VCDWriter


def write_vcd(timeline: Timeline, file: BinaryIO) -> None:
    """Booleans are wires, numbers are vectors (those with a sign in two's complement), decimals are reals, states and
    values of enumerations are strings. ModuleNotFoundError: pyvcd is not installed."""
    from vcd import VCDWriter

    lines = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    with VCDWriter(lines, timescale="1 ns", date="", comment=timeline.title, check_values=False) as writer:
        known: list[tuple[Signal, Any]] = []
        last = -1
        for row in timeline.rows:
            time = max(timeline.nanoseconds(row), last + 1)
            last = time
            if not known:
                for signal, value in zip(timeline.signals, row.values, strict=True):
                    known.append((signal, _declare(writer, signal, value)))
                continue
            for (signal, variable), value in zip(known, row.values, strict=True):
                writer.change(variable, time, _value(signal, value))
        if known:
            writer.close(last)
    lines.detach()


def _declare(writer: VCDWriter, signal: Signal, value: Shown) -> Any:
    scope, _, name = signal.name.rpartition(".")
    kind, size = _kind(signal)
    return writer.register_var(scope or "arrangement", name, kind, size=size, init=_value(signal, value))


def _kind(signal: Signal) -> tuple[str, int | None]:
    if signal.labels:
        return "string", None
    if signal.type.digits:
        return "real", None
    if signal.type.boolean:
        return "wire", 1
    low, high = signal.type.low, signal.type.high
    return "reg", max(1, high.bit_length()) if low >= 0 else 1 + max(high.bit_length(), (-low - 1).bit_length())


def _value(signal: Signal, value: Shown) -> int | float | str:
    kind, size = _kind(signal)
    if kind == "string":
        return str(value).replace(" ", "_")
    if isinstance(value, Decimal):
        return float(value)
    assert not isinstance(value, str)
    return int(value) & (1 << (size or 1)) - 1
