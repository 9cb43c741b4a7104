"""Arrangements as C99: for a caller, as programs for POSIX, and for AVR microcontrollers, each run on test vectors."""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.codes": (
        Entry("c", f"{__name__}.codes:CODES", "Programs in C"),
        Entry("avr", f"{__name__}.avr.codes:CODES", "Images for AVR microcontrollers"),
    ),
    "llfsm_verify.targets": (Entry("c", f"{__name__}.target:C99", "C99, with a function for each state"),),
    "llfsm_verify.worlds": (
        Entry("none", f"{__name__}.worlds:NONE", "for a caller of yours"),
        Entry("posix", f"{__name__}.posix:POSIX", "a program and a library that write recordings"),
        Entry("avr", f"{__name__}.avr.world:AVR", "a program for a microcontroller, with its pins"),
    ),
}
