"""Which inputs are wide enough to be split into classes, and what a user is told of one."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.program.program import Choice

WIDE = 16
"""Choices with at most so many values are enumerated as they are."""


@dataclass(frozen=True, slots=True)
class InputNote:
    """Inputs that are split together (most often one), with the number of their valuations.

    `classes`: the most that one reading tells apart; None: all values are tried, and `reason` says why.
    """

    inputs: tuple[str, ...]
    values: int
    classes: int | None
    reason: str | None = None


def size(choice: Choice) -> int:
    """The number of values."""
    return choice.type.high - choice.type.low + 1


def is_wide(choice: Choice) -> bool:
    """A choice of an input with too many values to be enumerated as a matter of course."""
    return choice.kind != "age" and size(choice) > WIDE
