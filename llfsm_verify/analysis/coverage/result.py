"""What is covered, what could be, what cannot be by proof, and what is not known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from llfsm_verify.analysis.coverage.goals import KINDS, Goal, Kind
from llfsm_verify.kripke.labels.sizes import InputNote

Status = Literal["covered", "reachable", "unreachable", "unknown"]
STATUSES: tuple[Status, ...] = get_args(Status)


@dataclass(frozen=True, slots=True)
class Taken:
    """A ringlet of a run: the process that takes it (None: all have ended), and the choices with their values as users
    write them."""

    process: str | None
    choices: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Judged:
    """A goal and what is known of it.

    `covered`: by the runs that were given. `reachable`: by other runs, for example `runs`, shortest ones: one, or two
    that together are an independence pair of a condition. `unreachable`: by no run; all configurations were explored.
    """

    goal: Goal
    status: Status
    runs: tuple[tuple[Taken, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Run:
    """A file whose runs count, or vectors that were found: how many `steps` (ringlets) there are in them."""

    name: str
    steps: int


@dataclass(frozen=True, slots=True)
class Coverage:
    """The answer of `llfsm coverage`."""

    arrangement: str
    path: str
    goals: tuple[Judged, ...]
    runs: tuple[Run, ...]
    configurations: int
    complete: bool
    """All configurations were explored."""
    reason: str | None
    """Why they were not."""
    modelled: tuple[str, ...]
    """Machines that are models of something else, of which nothing is to be covered."""
    surroundings: str | None = None
    """The machine that models the surroundings: what no run reaches is reached by none in these."""
    inputs: tuple[InputNote, ...] = ()
    seconds: float = field(default=0.0, compare=False)

    def of(self, status: Status) -> Iterator[Judged]:
        """The goals with a status, in order."""
        return (judged for judged in self.goals if judged.status == status)

    def counts(self) -> Mapping[Kind, Mapping[Status, int]]:
        """How many goals there are of each kind and status."""
        return {
            kind: {
                status: sum(j.goal.kind == kind and j.status == status for j in self.goals) for status in STATUSES
            }
            for kind in KINDS
        }  # fmt: skip

    @property
    def exit_code(self) -> int:
        """0, 1 where runs were given and miss what others reach, 4 where something is unknown."""
        if self.runs and any(self.of("reachable")):
            return 1
        return 4 if any(self.of("unknown")) else 0
