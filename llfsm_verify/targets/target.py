"""Targets, by the names that `--target` knows them by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.analysis.coverage.vectors import Vectors
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
    compiler: str = "cc"
    """The command that compiles for `verify`, but for a microcontroller."""
    emulator: str = ""
    """The command that runs what it made; empty: this computer does."""


@dataclass(frozen=True, slots=True)
class Made:
    """The texts of files by their names, and what a user is told."""

    files: Mapping[str, str]
    notes: tuple[str, ...]
    promise: tuple[str, ...] = ()
    """What is told before they are written."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Where a built image does not do what vectors say: sequence and step from 1 (step 0: the beginning)."""

    sequence: int
    step: int
    field: str
    expected: str
    found: str

    def __str__(self) -> str:
        return (
            f"sequence {self.sequence} differs in step {self.step}: "
            f"{self.field} is {self.found}, expected {self.expected}"
        )


@dataclass(frozen=True, slots=True)
class Verified:
    """What came of running a built image: lines for the user, and the first difference."""

    lines: tuple[str, ...]
    difference: Difference | None


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


@runtime_checkable
class Verifying(Protocol):
    """A target that can run what it makes."""

    def verify(self, arrangement: Arrangement, wanted: Wanted, made: Made, vectors: Vectors | None) -> Verified:
        """What `made` does with vectors, or with those that are found here. DiagnosticError: a compiler or an emulator
        is missing (E508), or it cannot be verified (E509)."""
        ...


TARGETS: Registry[Target] = Registry("target", (), "llfsm_verify.targets")
WORLDS: Registry[object] = Registry("world", (), "llfsm_verify.worlds")
"""What C is written for; what is at a place, the target `c` knows."""
