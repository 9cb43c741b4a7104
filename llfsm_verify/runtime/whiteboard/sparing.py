"""How many entries of an audit log a user may cause by what needs no right: the first ones, and then their number."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

FIRST, INTERVAL = 32, 60.0
"""So many entries of a user are written one by one in so many seconds; while there are more, only their number is."""


class _Counted:
    def __init__(self, until: float, *, listed: bool) -> None:
        self.until = until
        self.listed = listed
        """Entries of this interval are written, the first ones."""
        self.all = self.left_out = 0


class Sparing:
    """Counts entries by what they say and by the user that causes them."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._counted: dict[tuple[str, str], _Counted] = {}

    def writes(self, what: str, user: str, *, room: bool) -> bool:
        """Whether one more entry is written, where there is room for it; else it is counted."""
        counted = self._counted.setdefault((what, user), _Counted(self._clock() + INTERVAL, listed=True))
        counted.all += 1
        written = room and counted.listed and counted.all <= FIRST
        counted.left_out += not written
        return written

    def left_out(self, *, over: bool = False) -> Iterator[tuple[str, str, int]]:
        """What was counted in the intervals that have ended, all if the run is `over`: what, by whom, how often."""
        now = self._clock()
        for key, counted in [*self._counted.items()]:
            if now >= counted.until or over:
                del self._counted[key]
                if counted.left_out:
                    yield (*key, counted.left_out)
                if counted.all > FIRST:
                    self._counted[key] = _Counted(now + INTERVAL, listed=False)
