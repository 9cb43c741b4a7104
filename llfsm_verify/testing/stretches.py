"""What tests are given and runs consist of, as values: arrangements (frozen, or in a `Model`), stretches in which
inputs are held, how far each was performed, and why a run failed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.logic.properties import Property
from llfsm_verify.program.program import FaultSite
from llfsm_verify.values import Shown


@dataclass(frozen=True, slots=True, repr=False)
class Stretch:
    """Some inputs change, then all keep their values for a number of ringlets or of cycles.

    Exactly one of `ringlets` and `cycles` is given. `changes`: inputs, and ages of untimed states, by name. `reads`: in
    the first ringlet, single reads of inputs (`snapshot: none`) by the names of their choices. `process`: it alone
    takes the turns; otherwise the processes go round. A stretch ends with its process, or after the first
    stuttering step of an arrangement that ends meanwhile.
    """

    changes: Mapping[str, Shown] = field(default_factory=dict)
    ringlets: int | None = None
    cycles: int | None = None
    process: str | None = None
    reads: Mapping[str, Shown] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = self.cycles if self.ringlets is None else self.ringlets
        if count is None or (self.ringlets is not None and self.cycles is not None) or count < 0:
            raise ValueError("a stretch has a number of ringlets, or of cycles, and not both")

    @property
    def arguments(self) -> str:
        """What `Run.ringlets` and `Run.cycles` take, as Python text: the number first."""
        words = [str(self.turns)]
        words += [repr(dict(self.changes))] if self.changes else []
        words += [f"process={self.process!r}"] if self.process is not None else []
        words += [f"reads={dict(self.reads)!r}"] if self.reads else []
        return ", ".join(words)

    @property
    def turns(self) -> int:
        """Its number of ringlets or cycles."""
        return (self.cycles or 0) if self.ringlets is None else self.ringlets

    def of(self, turns: int) -> Stretch:
        """The same for another number of ringlets or cycles."""
        return replace(self, cycles=turns) if self.ringlets is None else replace(self, ringlets=turns)

    @property
    def unit(self) -> str:
        return "cycles" if self.ringlets is None else "ringlets"

    def __repr__(self) -> str:
        words = [repr(dict(self.changes))] if self.changes else []
        words.append(f"{self.unit}={self.turns}")
        words += [f"process={self.process!r}"] if self.process is not None else []
        words += [f"reads={dict(self.reads)!r}"] if self.reads else []
        return f"Stretch({', '.join(words)})"


@dataclass(frozen=True, slots=True)
class Performed:
    """A stretch as far as it was performed: in how many ringlets (one that faulted included), with which inputs."""

    stretch: Stretch
    ringlets: int
    inputs: Mapping[str, Shown]


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a run failed: properties whose monitors are certain, or a fault, or (neither) a value that left 64 bits."""

    violated: tuple[Property, ...]
    fault: FaultSite | None

    @property
    def names(self) -> tuple[str, ...]:
        """The violated properties."""
        return tuple(line.name for line in self.violated)

    @property
    def text(self) -> str:
        if self.violated:
            return f"{', '.join(self.names)} violated"
        return "an integer left 64 bits: what holds is unknown" if self.fault is None else self.fault.message


class Wrapper(Protocol):
    """A `llfsm_verify.Model`, which the room above this one defines."""

    @property
    def wrapped(self) -> Arrangement: ...


def unwrap(given: object) -> Arrangement:
    """The arrangement that is given, by itself or in a `Model`. TypeError: it is something else."""
    inside = getattr(given, "wrapped", given)
    if not isinstance(inside, Arrangement):
        raise TypeError(f"this is not an arrangement: {given!r:.80}")
    return inside
