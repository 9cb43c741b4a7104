"""The progress of long work on standard error, when that is a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Self

from llfsm_verify.checking.verdict import Progress
from llfsm_verify.diagnostics import counted

if TYPE_CHECKING:
    from rich.status import Status

PATIENCE = 0.5
"""Seconds before the first sign of progress: a short search shows none."""
INTERVAL = 0.2
SMOOTHING = 0.9
"""Weight of what came before in the rate at which new nodes are found: it jumps from level to level."""


class StatusLine:
    """A line that changes, from some time after the start on; nothing at all when standard error is no terminal."""

    def __init__(self) -> None:
        self.shown = sys.stderr.isatty()
        self.started = self._last = time.monotonic()
        self._status: Status | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._status is not None:
            self._status.stop()

    def show(self, written: Callable[[], str]) -> None:
        """Show what `written` gives, which is asked at most five times a second."""
        now = time.monotonic()
        if not self.shown or now - self.started < PATIENCE or now - self._last < INTERVAL:
            return
        self._last = now
        if self._status is None:
            from rich.console import Console
            from rich.status import Status

            self._status = Status("", console=Console(stderr=True, highlight=False, markup=False))
            self._status.start()
        from rich.text import Text

        self._status.update(Text(written(), no_wrap=True, overflow="ellipsis"))


class ProgressLine(StatusLine):
    """A line that says how far the search is.

    A check may search more than once, with other reductions or another engine: searches are numbered from the second
    one on, and within one of them no number goes back.
    """

    def __init__(self) -> None:
        super().__init__()
        self._before: Progress | None = None
        self._smooth: float | None = None
        self._search = 1
        self._most = 0

    def update(self, progress: Progress) -> None:
        self.show(lambda: self.text(progress))

    def text(self, progress: Progress) -> str:
        """The line."""
        if progress.states < self._most:
            self._search, self._before, self._smooth = self._search + 1, None, None
        self._most = progress.states
        text = progress_text(progress, self._growth(progress))
        return text if self._search == 1 else f"search {self._search}: {text}"

    def _growth(self, progress: Progress) -> float | None:
        """Nodes found for each one expanded lately, smoothed; None when that is not known."""
        before, self._before = self._before, progress
        if before is None or progress.expanded <= before.expanded:
            return None
        growth = (progress.found - before.found) / (progress.expanded - before.expanded)
        self._smooth = growth if self._smooth is None else SMOOTHING * self._smooth + (1 - SMOOTHING) * growth
        return self._smooth


def progress_text(progress: Progress, growth: float | None = None) -> str:
    """How far a search is, in one line: what it does; or rate, frontier, depth and an estimate of the end; and memory.

    `growth` is the number of nodes that were found for each node expanded lately. Were it to stay below 1, the frontier
    would have 1 / (1 - growth) times as many nodes still to be expanded (a geometric series).
    """
    if progress.doing:
        sizes = (
            (progress.states, counted(progress.states, "configuration")),
            (progress.memory, f"{progress.memory / 2**20:,.0f} MiB"),
            (True, f"{progress.seconds:.0f} s"),
            (progress.depth, f"depth {progress.depth:,}"),
        )
        return ", ".join([*(text for known, text in sizes if known), progress.doing])
    rate = progress.states / progress.seconds if progress.seconds > 0 else 0.0
    frontier = progress.found - progress.expanded
    text = (
        f"{counted(progress.states, 'configuration')}, {rate:,.0f}/s, {progress.memory / 2**20:,.0f} MiB, "
        f"{progress.seconds:.0f} s, frontier {frontier:,}, depth {progress.depth:,}"
    )
    if growth is None or growth >= 1 or progress.expanded == 0 or frontier == 0:
        return text
    left = frontier / (1 - growth)
    return f"{text}, about {left:,.0f} to go ({left * progress.seconds / progress.expanded:,.0f} s)"
