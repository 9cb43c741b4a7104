"""What is in a frame, word by word; it follows from the program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from llfsm_verify.backends.native.layout import WORD_BYTES, Layout
from llfsm_verify.program.program import EventKind, Program

# The words of a frame before the record.
NUMBER = 0  # from 1; the frame before the first turn is number 1
CYCLE = 1  # logical time in cycles: rounds of turns before this one
COMMITTED = 2  # monotonic clock, nanoseconds
LATENESS = 3  # of the begin of the turn, nanoseconds
MOVED = 4  # nanoseconds by which lateness has moved the schedule for good, so far
PROCESS = 5  # whose turn it was, from 0; -1 in the first frame
ENDING = 6  # 0 while it runs, else one of `ENDINGS`
DETAIL = 7  # of a fault: 1 + its number; of a signal its number
STEPS = 8  # ringlets so far
HEADER_WORDS = 9
HEADER = {
    "NUMBER": NUMBER, "CYCLE": CYCLE, "COMMITTED": COMMITTED, "LATENESS": LATENESS, "MOVED": MOVED, "PROCESS": PROCESS,
    "ENDING": ENDING, "DETAIL": DETAIL, "STEPS": STEPS,
}  # fmt: skip

ENDINGS = ("running", "ended", "stopped", "fault", "overflow", "overrun", "died", "violated", "replaced")
COUNTED: tuple[EventKind, ...] = (
    "suspend", "resume", "restart", "accept", "load", "unload", "faulted", "refused",
)  # fmt: skip
"""The kinds of events that are counted."""


@dataclass(frozen=True, slots=True)
class FrameLayout:
    """Where each part of a frame begins, in words."""

    record: int
    fired: int
    """Of each slot: 0, or 1 + the number of the transition that fired in the last cycle of its process."""
    choices: int
    """The value of each choice where the turn began."""
    events: int
    """How often each kind of `COUNTED` has happened."""
    monitors: int
    """The state of each monitor."""
    words: int

    @staticmethod
    def of(program: Program, layout: Layout, monitors: int = 0) -> FrameLayout:
        """The layout of the frames of a program with so many monitors."""
        fired = HEADER_WORDS + layout.record_bytes // WORD_BYTES
        choices = fired + len(program.slots)
        events = choices + len(program.choices)
        states = events + len(COUNTED)
        return FrameLayout(HEADER_WORDS, fired, choices, events, states, states + monitors)

    def record_of(self, words: Sequence[int]) -> bytes:
        """The executor's record in a frame."""
        mask = (1 << 64) - 1
        return b"".join((w & mask).to_bytes(WORD_BYTES, "little") for w in words[self.record : self.fired])
