"""What a supervisor does while the loop runs: it serves those who want something, and waits."""

from __future__ import annotations

import select
from collections.abc import Sequence
from typing import Protocol

PATIENCE = 0.05
"""Seconds between two looks, at most."""


class Attendant(Protocol):
    """Serves somebody beside the loop: a whiteboard, ports."""

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case."""

    def fileno(self) -> int:
        """Readable when `serve` has something to do."""

    def serve(self, seconds: float) -> None:
        """Do what is to be done, and wait at most so long for it."""


class Ending(Protocol):
    """A run that goes on elsewhere."""

    def fileno(self) -> int:
        """Readable when it has ended."""

    def wait(self, seconds: float | None = None) -> bool:
        """Whether it has ended."""


def serve(running: Ending, attendants: Sequence[Attendant]) -> None:
    """Serve until the run has ended."""
    poll = select.poll()
    for descriptor in (running.fileno(), *(one.fileno() for one in attendants)):
        poll.register(descriptor, select.POLLIN)
    while not running.wait(0):
        poll.poll(1000 * min([PATIENCE, *(one.patience for one in attendants)]))
        for one in attendants:
            one.serve(0)
