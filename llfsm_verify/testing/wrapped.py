"""Arrangements as tests are given them: the frozen value, or a `Model` around it."""

from __future__ import annotations

from typing import Protocol

from llfsm_verify.arrangement.model import Arrangement


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
