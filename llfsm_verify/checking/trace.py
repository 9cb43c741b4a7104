"""Traces: runs of an arrangement as values, a path to a bad prefix or fault, or a stem with a loop."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from llfsm_verify.program.program import FaultSite


@dataclass(frozen=True, slots=True)
class Sampled:
    """A choice that a step or its letter read: its name in the program, the input it samples ("" for an age), value and
    its text."""

    choice: str
    input: str
    value: int
    text: str


@dataclass(frozen=True, slots=True)
class Change:
    """A variable (array elements by themselves) that a step changed, with the texts of its values."""

    variable: str
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class Cause:
    """An atom whose value in one letter is a cause of the failure (docs/decisions/0017-causes.md), and the variables,
    inputs and machines that it reads, with the texts of their values there."""

    atom: str
    value: bool
    variables: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Event:
    """What a property asks by `refused(m)` or `faulted(m)`, and the place of it."""

    kind: Literal["refused", "faulted"]
    site: FaultSite


@dataclass(frozen=True, slots=True)
class TraceStep:
    """One ringlet, or the stutter of an ended arrangement (`process` and `machine` None)."""

    process: str | None
    machine: str | None
    state: str
    """The machine's state in which the ringlet was spent (after pending commands), "" in a stutter."""
    fired: str | None
    """``RED -> GREEN when car`` for the transition that fired."""
    sampled: tuple[Sampled, ...]
    changes: tuple[Change, ...]
    cycle: bool
    """The ringlet completed a cycle of its process."""
    observed: bool
    """A letter of the observed word follows this step (always, unless `observe: cycle`)."""
    atoms: tuple[tuple[str, bool], ...]
    """The atoms of the property in the letter after this step (empty when not observed)."""
    causes: tuple[Cause, ...] = ()
    """Those whose values in that letter cause the failure, in the order of `atoms`."""
    world: tuple[Sampled, ...] = ()
    """The inputs that the letter shows and that no machine has sampled in this step: they were in the surroundings."""
    events: tuple[Event, ...] = ()
    """What the machine was refused, and the fault that unloaded it."""

    @property
    def choices(self) -> tuple[Sampled, ...]:
        """All that the step and its letter read, in the order of reading."""
        return (*self.sampled, *self.world)


@dataclass(frozen=True, slots=True)
class Trace:
    """`initial` is the first configuration as (variable, text); `initial_atoms` the first letter.

    `loop` None: a finite run, ending in a bad prefix, or in `fault` (raised by one more ringlet, the last of `steps`,
    which then has no changes). Otherwise ``steps[loop:]`` repeats forever, and is not empty.
    """

    initial: tuple[tuple[str, str], ...]
    initial_free: tuple[tuple[str, int], ...]
    """Values of the free variables of the initial configuration (an array's elements in order, as ``name[0]``)."""
    initial_atoms: tuple[tuple[str, bool], ...]
    steps: tuple[TraceStep, ...]
    loop: int | None
    fault: FaultSite | None = None
    initial_causes: tuple[Cause, ...] = ()
    """Atoms whose values in the first letter cause the failure."""
    because: str | None = None
    """Why the property fails, in a clause; None for faults."""
    failed_at: int | None = None
    """The step after which nothing can satisfy the property any more (0: none is needed), or None."""
    witness: bool = False
    """Shows a run with a property, instead of one without."""
    escape: bool = False
    """Shows how a run comes to where the arrangement escapes its assumptions: after the last step."""
    period: Fraction | None = None
    """Milliseconds of logical time that a cycle takes; None: untimed."""


def letter_steps(trace: Trace) -> list[int]:
    """The number of the step that shows each letter, counted from 1; 0 for the first letter."""
    return [0, *(number for number, step in enumerate(trace.steps, 1) if step.observed)]
