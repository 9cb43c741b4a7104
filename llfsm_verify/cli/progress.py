"""The progress of a search on standard error, when that is a terminal."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from llfsm_verify.checking.verdict import Progress

if TYPE_CHECKING:
    from rich.status import Status

PATIENCE = 0.5
"""Seconds before the first sign of progress: a short search shows none."""
INTERVAL = 0.2


class ProgressLine:
    """A line that says how far the search is; nothing at all when standard error is no terminal."""

    def __init__(self) -> None:
        self.shown = sys.stderr.isatty()
        self._started = self._last = time.monotonic()
        self._status: Status | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._status is not None:
            self._status.stop()

    def update(self, progress: Progress) -> None:
        """Show `progress`, at most five times a second."""
        now = time.monotonic()
        if now - self._started < PATIENCE or now - self._last < INTERVAL:
            return
        self._last = now
        if self._status is None:
            from rich.console import Console
            from rich.status import Status

            self._status = Status("", console=Console(stderr=True, highlight=False, markup=False))
            self._status.start()
        self._status.update(progress_text(progress))


def progress_text(progress: Progress) -> str:
    """Configurations, rate, depth and memory in one line."""
    rate = progress.states / progress.seconds if progress.seconds > 0 else 0.0
    return (
        f"{progress.states:,} configurations, {progress.expanded:,} expanded, {rate:,.0f}/s, depth {progress.depth:,}, "
        f"{progress.memory / 2**20:,.0f} MiB, {progress.seconds:.0f} s"
    )
