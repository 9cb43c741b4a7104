"""Microcontrollers whose timer 1 has 16 bits: their pins, their memories, and how the timer makes a cycle."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.avr.codes import WRONG_TICK
from llfsm_verify.plug import did_you_mean

PRESCALERS = {
    1: "_BV(CS10)",
    8: "_BV(CS11)",
    64: "_BV(CS11) | _BV(CS10)",
    256: "_BV(CS12)",
    1024: "_BV(CS12) | _BV(CS10)",
}
COUNTS, MOST_TICKS = 1 << 16, 1 << 16
FEWEST = 500
"""Steps of the CPU in the shortest cycle: no ringlet with its tick takes fewer."""


@dataclass(frozen=True, slots=True)
class Chip:
    """`ports`: the bits of each port that have a pin. `serial`: the pins of its serial port, receiver first, and the
    number that its registers have."""

    name: str
    flash: int
    ram: int
    ports: dict[str, str]
    serial: tuple[str, str]
    unit: int = 0

    @property
    def pins(self) -> tuple[str, ...]:
        """Those that a table may name: without the pin of the reset and those of a crystal."""
        return tuple(f"P{port}{bit}" for port, bits in self.ports.items() for bit in bits)


_SMALL = {"B": "012345", "C": "012345", "D": "01234567"}
_ALL = "01234567"
_MIDDLE = dict.fromkeys("ABCD", _ALL)
_LARGE = dict.fromkeys("ABCDEF", _ALL) | {"G": "012345"} | dict.fromkeys("HJKL", _ALL)
_PD, _PE = ("PD0", "PD1"), ("PE0", "PE1")
CHIPS = {
    chip.name: chip
    for chip in (
        Chip("atmega48p", 4 << 10, 512, _SMALL, _PD),
        Chip("atmega88p", 8 << 10, 1 << 10, _SMALL, _PD),
        Chip("atmega168p", 16 << 10, 1 << 10, _SMALL, _PD),
        Chip("atmega328p", 32 << 10, 2 << 10, _SMALL, _PD),
        Chip("atmega644p", 64 << 10, 4 << 10, _MIDDLE, _PD),
        Chip("atmega1284p", 128 << 10, 16 << 10, _MIDDLE, _PD),
        Chip("atmega2560", 256 << 10, 8 << 10, _LARGE, _PE),
    )
}


def chip_of(name: str) -> Chip:
    """DiagnosticError (E507): no microcontroller of ours has this name."""
    if name not in CHIPS:
        hint = did_you_mean(name, CHIPS) or f"there are: {', '.join(CHIPS)}"
        message = f"nothing is known of the microcontroller `{name[:40]}`"
        raise DiagnosticError(Diagnostic(WRONG_TICK, message, hint=hint))
    return CHIPS[name]


@dataclass(frozen=True, slots=True)
class Tick:
    """Timer 1 counts to `counts` at the clock divided by `prescaler`, `interrupts` times a cycle."""

    prescaler: int
    counts: int
    interrupts: int
    error: Fraction = Fraction(0)
    """By how much a cycle is longer than it should be, as a part of it."""


def tick_of(chip: Chip, period: Fraction, clock_hz: int) -> Tick:
    """The tick for a cycle of `period` milliseconds: exact where it can be, with few interrupts.

    DiagnosticError (E507): the cycle is too short or too long, or more than 100 millionths of it are missing.
    """
    cycles = period * clock_hz / 1000
    found: list[Tick] = []
    for prescaler in PRESCALERS:
        least = -(-cycles // (prescaler * COUNTS))
        for interrupts in range(max(1, int(least)), min(int(least) + 8, MOST_TICKS)):
            counts = round(cycles / (prescaler * interrupts))
            if 2 <= counts <= COUNTS:
                found.append(Tick(prescaler, counts, interrupts, counts * prescaler * interrupts / cycles - 1))
    best = (
        None if cycles < FEWEST else min(found, key=lambda t: (abs(t.error), t.interrupts, t.prescaler), default=None)
    )
    if best is not None and abs(best.error) <= Fraction(1, 10_000):
        return best
    why = "is too short" if cycles < FEWEST else "is too long" if best is None else "cannot be made exactly"
    message = f"a cycle of {float(period):g} ms {why} for timer 1 of the {chip.name} at {clock_hz} Hz"
    hint = "give the frequency of its clock (`--clock-hz`), or another `cycle_ms:`"
    raise DiagnosticError(Diagnostic(WRONG_TICK, message, hint=hint))
