"""What the explicit engine can be told beside what all engines are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

When = Literal["auto", "on", "off"]


@dataclass(frozen=True, slots=True)
class Checkpointing:
    """``--checkpoint``: where to save, how often (seconds), and whether to go on from what is there."""

    path: Path
    every: float = 60.0
    resume: bool = False


class CheckpointWarning(UserWarning):
    """Issued, once for failures in a row, when a checkpoint could not be saved; the message is a rendered diagnostic
    (W402)."""


@dataclass(frozen=True, slots=True)
class ExplicitOptions:
    """One of `Options.own`."""

    cone: When = "auto"
    """Leave out what no property depends on: always, never, or when the space is large."""
    labels: bool = True
    """Split wide inputs into classes instead of trying all their values."""
    compression: When = "auto"
    """Do not store configurations with one step only: always, never, or when the space is large and has many."""
    checkpoint: Checkpointing | None = None
    """Save the search now and then, and go on from what was saved."""
