"""What the explicit engine can be told beside what all engines are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, TypedDict

from llfsm_verify.checking.engine_option import (
    FILE,
    FLAG,
    JOBS,
    SECONDS,
    SWITCH,
    WHEN,
    EngineOption,
    EngineOptions,
    When,
)

EVERY = 60.0
"""Seconds between two saves, unless the user says something else."""


JOBS_OPTION = EngineOption(
    "jobs", "--jobs", kind=JOBS, help="search with N threads; results are the same (default: all processors)"
)


class JobsKeyword(TypedDict, total=False):
    """The option of everything that explores at length."""

    jobs: int | None
    """Threads; None: as many as the processors that this process may use. Results are the same."""


class ExplicitKeywords(JobsKeyword, total=False):
    """The options as keywords of Python."""

    cone: When | None
    """Leave out what no property depends on."""
    compression: When | None
    """Do not store configurations with one step only."""
    labels: bool | None
    """Split wide inputs into classes of values."""
    checkpoint: str | Path | None
    """The file in which a long search is saved now and then."""
    checkpoint_every: float | None
    """Seconds between two such saves."""
    resume: bool | None
    """Go on from the checkpoint."""


@dataclass(frozen=True, slots=True)
class Checkpointing:
    """``--checkpoint``: where to save, how often (seconds), and whether to go on from what is there."""

    path: Path
    every: float = EVERY
    resume: bool = False


class CheckpointWarning(UserWarning):
    """Issued, once for failures in a row, when a checkpoint could not be saved and `Options.tell` takes no sentences;
    the message is a rendered diagnostic (W402)."""


@dataclass(frozen=True, slots=True)
class ExplicitOptions(EngineOptions):
    """One of `Options.own`."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (
        EngineOption(
            "cone", "--cone", ("auto", "off"), kind=WHEN, default="auto",
            help="leave out what no property depends on; auto: when the space is large",
        ),
        EngineOption(
            "compression", "--compression", ("auto", "off"), kind=WHEN, default="auto", old=("--chains",),
            help="do not store configurations with one step only; auto: when the space is large",
        ),
        EngineOption(
            "labels", "--labels", (True,), kind=SWITCH, default=True,
            help="explore wide inputs by classes of values instead of value by value",
        ),
        EngineOption(
            "checkpoint", "--checkpoint", kind=FILE, sole=True,
            help="save a long search there at intervals, and when a limit ends it",
        ),
        EngineOption(
            "checkpoint_every", "--checkpoint-every", kind=SECONDS, help=f"how often (default: {EVERY:g})",
            part_of="checkpoint", alone="says how often to save to the file that {} names",
        ),
        EngineOption(
            "resume", "--resume", (False,), kind=FLAG, help="continue from the checkpoint",
            part_of="checkpoint", alone="goes on from the file that {} names",
        ),
        JOBS_OPTION,
    )  # fmt: skip

    cone: When = "auto"
    """Leave out what no property depends on: always, never, or when the space is large."""
    labels: bool = True
    """Split wide inputs into classes instead of trying all their values."""
    compression: When = "auto"
    """Do not store configurations with one step only: always, never, or when the space is large and has many."""
    checkpoint: Checkpointing | None = None
    """Save the search now and then, and go on from what was saved."""
    jobs: int | None = None
    """Threads; None: as many as processors."""

    @classmethod
    def made(cls, given: Mapping[str, Any]) -> Self:
        """From values by the names of options; three of them are about one checkpoint."""
        found = cls.fields_of(given)
        if "checkpoint" in found:
            every, resume = given.get("checkpoint_every", EVERY), given.get("resume", False)
            found["checkpoint"] = Checkpointing(Path(found["checkpoint"]), every, resume)
        return cls(**found)
