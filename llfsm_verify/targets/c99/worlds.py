"""What C is written for, by the names that `--for` knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from llfsm_verify.registry import Entry, Registry
from llfsm_verify.targets.target import Made, Wanted

if TYPE_CHECKING:
    from llfsm_verify.targets.c99.image import Image


class World(Protocol):
    """What is written around an image for one kind of machine."""

    def __call__(self, image: Image, wanted: Wanted, /) -> Made:
        """The files beside NAME.h and NAME.c, and what a user is told. DiagnosticError: it has no meaning there."""
        ...


WORLDS: Registry[World] = Registry(
    "world",
    [
        Entry("none", "llfsm_verify.targets.c99.worlds:caller", "for a caller of yours"),
        Entry("posix", "llfsm_verify.targets.c99.posix:posix", "a program and a library that write recordings"),
        Entry("avr", "llfsm_verify.targets.c99.avr.world:avr", "a program for a microcontroller, with its pins"),
    ],
)
RECORDING = frozenset({"posix"})
"""The worlds whose images count what frames of a recording count."""


def caller(image: Image, _wanted: Wanted, /) -> Made:
    """See `World`."""
    name = f"{image.prefix}_cycle" if image.monitors is None else f"{image.prefix}_monitored_cycle"
    return Made({}, (f"Call {name} once in {float(image.program.period or 0):g} ms.",))
