"""What C is written for, by the names that `--for` knows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry
from llfsm_verify.targets.target import Made, Wanted

if TYPE_CHECKING:
    from llfsm_verify.targets.c99.image import Image
    from llfsm_verify.targets.c99.verifying.run import Bench


def computer(wanted: Wanted) -> Bench:
    """See `World`."""
    from llfsm_verify.targets.c99.verifying.run import on_computer

    return on_computer(wanted)


@dataclass(frozen=True, slots=True)
class World:
    """A kind of machine. `make`: the files beside NAME.h and NAME.c, and what a user is told; `bench`: how built images
    are run for `--verify`; `counts`: whether they count what frames of a recording count.

    DiagnosticError: what is wanted has no meaning there.
    """

    make: Callable[[Image, Wanted], Made]
    bench: Callable[[Wanted], Bench] = computer
    counts: bool = False


def caller(image: Image, _wanted: Wanted, /) -> Made:
    """See `World`."""
    name = f"{image.prefix}_cycle" if image.monitors is None else f"{image.prefix}_monitored_cycle"
    return Made({}, (f"Call {name} once in {float(image.program.period or 0):g} ms.",))


NONE = World(caller)
WORLDS: Registry[World] = Registry(
    "world",
    [
        Entry("none", "llfsm_verify.targets.c99.worlds:NONE", "for a caller of yours"),
        Entry("posix", "llfsm_verify.targets.c99.posix:POSIX", "a program and a library that write recordings"),
    ],
    "llfsm_verify.worlds",
)
