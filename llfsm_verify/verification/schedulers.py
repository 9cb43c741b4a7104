"""Schedulers: who performs tasks that do not depend on each other in other processes, by the scheme of an address."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from llfsm_verify.registry import Registry

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Lost:
    """What comes of a task that ends the process which performs it."""

    reason: str
    seconds: float = 0.0
    """How long it took the last time, if that is known."""


class Scheduler(Protocol):
    """Who has workers, which share no disk with us."""

    def run(self, call: Callable[[T], R], tasks: Iterable[T], ended: Callable[[T, R | Lost], None]) -> None:
        """Perform `call`, a function of a module that raises nothing, on each task, and tell of each once, in any
        order, in this thread.

        Tasks are taken from `tasks` as there are workers for them. KeyboardInterrupt passes, as what `ended` raises:
        all that is known then was told, and what is not is given up. DiagnosticError: workers cannot be reached, or
        not any more, or they differ from us.
        """

    def close(self) -> None:
        """Give back what it holds."""


SCHEDULERS: Registry[Callable[[str, int | None], Scheduler]] = Registry("scheduler", (), "llfsm_verify.schedulers")
"""Each gets the whole address (`tcp://host:8786`), and how many workers are wanted where it starts them (None: as many
as processors). DiagnosticError: it is not there."""
