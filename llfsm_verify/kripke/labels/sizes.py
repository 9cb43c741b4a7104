"""Which inputs are wide enough to be split into classes."""

from __future__ import annotations

from llfsm_verify.program.program import Choice

WIDE = 16
"""Choices with at most so many values are enumerated as they are."""


def size(choice: Choice) -> int:
    """The number of values."""
    return choice.type.high - choice.type.low + 1


def is_wide(choice: Choice) -> bool:
    """A choice of an input with too many values to be enumerated as a matter of course."""
    return choice.kind != "age" and size(choice) > WIDE
