"""What a user is told of a wide input: into how many classes it was split, or why it was enumerated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class InputNote:
    """Inputs that are split together (most often one), with the number of their valuations.

    `classes`: the most that one reading tells apart; None: all values are tried, and `reason` says why.
    """

    inputs: tuple[str, ...]
    values: int
    classes: int | None
    reason: str | None = None
