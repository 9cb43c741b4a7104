"""What an exploration may use, and how it is told that there is no more."""

from __future__ import annotations

from typing import Literal, Protocol


class LimitReached(Exception):
    """A limit has been reached; the message says which, in a sentence."""


def reached(most: int, what: Literal["configurations", "steps"]) -> str:
    """What is said when there are more than so many."""
    return f"the limit of {most:,} {what} was reached"


class Allowance(Protocol):
    """What an exploration may use."""

    @property
    def max_states(self) -> int | None: ...

    @property
    def max_steps(self) -> int | None: ...

    def check(self, more: int = 0) -> None:
        """Raises LimitReached when time or memory is used up, or would be with `more` bytes."""
