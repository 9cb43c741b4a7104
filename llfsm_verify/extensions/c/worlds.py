"""What C is written for: what a world adds to NAME.h and NAME.c."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from llfsm_verify.plug import WORLDS, Made
from llfsm_verify.plug import TargetWanted as Wanted

if TYPE_CHECKING:
    from llfsm_verify.extensions.c.image import Image
    from llfsm_verify.extensions.c.verifying.run import Bench


def computer(wanted: Wanted) -> Bench:
    """See `World`."""
    from llfsm_verify.extensions.c.verifying.run import on_computer

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


def world(name: str) -> World:
    """What is registered under a name (`WORLDS`)."""
    return cast(World, WORLDS.load(name))
