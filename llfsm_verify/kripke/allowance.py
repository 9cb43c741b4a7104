"""What an exploration may use, and how it is told that there is no more."""

from __future__ import annotations

from typing import Protocol


class LimitReached(Exception):
    """A limit has been reached; the message says which, in a sentence."""


class Allowance(Protocol):
    """What an exploration may use."""

    @property
    def max_states(self) -> int | None: ...

    def check(self, more: int = 0) -> None:
        """Raises LimitReached when time or memory is used up, or would be with `more` bytes."""
