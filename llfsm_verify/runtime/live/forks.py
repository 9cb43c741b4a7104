"""Processes that are forked for a run, and what one that the user's program forks must not keep of it.

A copy of the pipe by whose end the loop learns that its supervisor has died would keep the loop going, and a copy of
the socket of a whiteboard would let callers wait for an answer.
"""

from __future__ import annotations

import os
import warnings
from itertools import pairwise
from typing import Protocol
from weakref import WeakSet


class Kept(Protocol):
    """Something of a run that belongs to one process alone."""

    def let_go(self) -> None:
        """This process is a child of the one that it belongs to: close its descriptors, and nothing else."""


_kept: WeakSet[Kept] = WeakSet()


def keep(one: Kept) -> None:
    """Let a child of this process let go of it."""
    _kept.add(one)


def _forked() -> None:
    for one in list(_kept):
        one.let_go()
    _kept.clear()


os.register_at_fork(after_in_child=_forked)


def fork() -> int:
    """As `os.fork`. Of several threads only this one goes on in the new process, which then does only what it was
    forked for, so Python's warning is left out.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def close_but(kept: set[int]) -> None:
    """Close all descriptors of this process but some: others shall see when their owner closes them."""
    most = os.sysconf("SC_OPEN_MAX")
    for low, high in pairwise([-1, *sorted(kept), most if most > 0 else 1 << 20]):
        if low + 1 < high:  # `closerange(0, 0)` closes all
            os.closerange(low + 1, high)
