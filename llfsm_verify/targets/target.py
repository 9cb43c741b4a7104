"""Targets, by the names that `--target` knows them by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.diagnostics import Source
    from llfsm_verify.targets.monitors import Watched


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a user wants of a target. `world`: a name of `Target.worlds`; `sources`: the texts of the arrangement, which
    are in its recordings."""

    world: str
    optimize: Literal["size", "speed"] = "speed"
    pins: str | None = None
    """The path of a table of pins; None: `pins.yaml` beside the arrangement."""
    mcu: str = "atmega328p"
    clock_hz: int = 16_000_000
    sources: tuple[Source, ...] = ()
    monitors: Watched | None = None


@dataclass(frozen=True, slots=True)
class Made:
    """The texts of files by their names, and what a user is told."""

    files: Mapping[str, str]
    notes: tuple[str, ...]
    promise: tuple[str, ...] = ()
    """What is told before they are written."""


class Target(Protocol):
    """A language in which arrangements are written for other machines. `worlds`: what `--for` takes, with a line about
    each.

    `mark` is in the first line of each of its files.
    """

    worlds: Mapping[str, Entry]
    mark: str

    def make(self, arrangement: Arrangement, wanted: Wanted) -> Made:
        """The files. `arrangement` is as `images.image_of` returns it. DiagnosticError: it has no meaning there."""
        ...


TARGETS: Registry[Target] = Registry(
    "target",
    [Entry("c", "llfsm_verify.targets.c99.target:C99", "C99, with a function for each state")],
    "llfsm_verify.targets",
)
