"""Who writes the frames that a loop reads its inputs from: rows that say where the frames and their copies are.

The first writer is the process that serves the whiteboard. The others are processes that were lent a segment, and write
it without asking anybody. Such a segment is lent once: who had it can still write it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.memory import store, words
from llfsm_verify.runtime.whiteboard.segment import Segment

LENT = 15
"""So many segments can be lent in a run."""
ROW_WORDS = 5


class Refused(ValueError):
    """A request that is not granted; the message says why."""


class Writers:
    """The rows of a loop's writers, whose frames have so many words; `lent`: how many segments may be lent. Made before
    processes of the run are forked, which could not map a segment later.
    """

    def __init__(self, loop: Loop, frame_words: int, lent: int) -> None:
        self._loop = loop
        self._frame_words = frame_words
        self._rows = words((1 + lent) * ROW_WORDS)
        self._scratch = words(frame_words)
        self._zero = words(1)
        self._segments: list[Segment] = []
        try:
            for _ in range(lent):
                self._segments.append(Segment("posts", frame_words, lent=True))
        except OSError:
            self.close()
            raise
        self._copies = [words(frame_words) for _ in range(lent)]
        loop.control[control.WRITERS] = ctypes.addressof(self._rows)

    def add(self, segment: int, copy: ctypes.Array[ctypes.c_int64]) -> None:
        """One more row: the address of a segment, and where its newest frame is copied to."""
        number = self._loop.control[control.WRITER_COUNT]
        row = [segment, ctypes.addressof(copy), self._frame_words, 0, ctypes.addressof(self._scratch)]
        store(row, self._rows, number * ROW_WORDS)
        self._loop.control[control.WRITER_COUNT] = number + 1

    def lend(self, granted: Callable[[], None]) -> tuple[Segment, ctypes.Array[ctypes.c_int64]]:
        """A segment that nobody has had, and where the loop copies it to. `granted` is called before the loop reads it.
        Refused: all were lent, or `granted` says so.
        """
        number = self._loop.control[control.WRITER_COUNT] - 1
        if number >= len(self._segments):
            raise Refused(f"{LENT} writers have had memory of their own in this run, and there is no more")
        granted()
        self.add(self._segments[number].address, self._copies[number])
        return self._segments[number], self._copies[number]

    def copy_of(self, segment: Segment) -> ctypes.Array[ctypes.c_int64]:
        """Where the loop copies a lent segment to."""
        return self._copies[self._segments.index(segment)]

    def newest_of(self, segment: Segment) -> ctypes.Array[ctypes.c_int64]:
        """The newest frame of a lent segment. It is looked at once, since its writer can write anything there and
        leave it; where it is not whole, it is what the loop has read last.
        """
        return segment.glance() or self.copy_of(segment)

    @property
    def nothing(self) -> int:
        """The address of a word that is 0."""
        return ctypes.addressof(self._zero)

    def close(self) -> None:
        """The loop must not run any more."""
        self._loop.control[control.WRITER_COUNT] = 0
        for segment in self._segments:
            segment.close()
