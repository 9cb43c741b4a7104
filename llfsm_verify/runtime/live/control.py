"""The control block: what the loop in machine code is told, and what it tells, as an array of 64-bit words; and the
memory for such arrays, which a run shares with the processes that it forks."""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Iterable

# What it is told.
STOP = 0  # not 0: return before the next turn (read with acquire: another thread sets it); PAUSE: it may go on later
TURNS = 1  # turns left; negative: no limit
PERIOD = 2  # nanoseconds of a cycle; 0: do not wait
JITTER = 3  # nanoseconds by which two turns may be closer
STRICT = 4  # not 0: return where a turn is late by a period
IMAGE = 5  # address of the frame that is being made
PREVIOUS = 6  # address of the frame that was recorded last
SEGMENT = 7  # address of the segment in which frames are published, or 0
LOG = 8  # address of the word that says how many bytes of the recording are whole, or 0: nothing is recorded
LIMIT = 9  # address where the mapped part of the recording ends
SCRIPT = 10  # address of (step, choice, value), ordered by step
SCRIPT_LEFT = 11  # how many of them are left
DRAWN = 12  # address of the table by which choices are drawn before each turn (`runtime.stepping.drawing`), or 0
RANDOM = 13  # state of the generator that draws
WRITERS = 14  # address of (segment, copy, words, number of the newest frame read, where it is checked first)
WRITER_COUNT = 15
SOURCES = 16  # address of (choice, address of the value, lowest value, values less one, address of a word that is 0
# before the first value)
SOURCE_COUNT = 17
STATES = 18  # address of the states of monitors
HISTOGRAM = 19  # address of 512 counts of latenesses
UNTIL_SETTLED = 20  # not 0: return where a monitor becomes settled
ROUNDS = 21  # return before the round of this number, as a number without a sign
MINE = 22  # the only process whose turns are taken here; -1: those of all
COMMAND = 23  # address of (number, choice, choice of a value or -1, value): what an operator commands, or 0

# What it keeps and tells.
BASE = 24  # monotonic nanoseconds at which round 0 was due
ROUND = 25  # rounds of turns so far: the logical time
STARTED = 26  # monotonic nanoseconds at which the last round began
LAST = 27  # the process that had the last turn; -1 at first
OVERRUNS = 28
WORST = 29  # largest lateness
CURSOR = 30  # address at which the recording goes on
REASON = 31  # why it returned: see below
REFUSED = 32  # values from outside that were not of their slot's type
LATE = 33  # lateness of the turn under way
SETTLED = 34  # not 0: a monitor became settled in this turn
ENTRY = 35  # address at which what this turn records begins
NEXT = 36  # the process whose turn it is, where that is not `MINE`
RECORDED_BYTES = 37  # of the recording, with the entry that is being published
RECORDED = 38  # number of the frame of that entry
TAKEN = 39  # number of the last command that was taken
TAKEN_FRAME = 40  # number of the frame at the end of that cycle
GIVEN = 41  # 1 + the choice by which that command came; 0: it is over
WAKES = 42  # address of rows of 16 words: length of an address, or 0, and the address
WAKE_COUNT = 43
WAKE_SOCKET = 44  # descriptor of the socket that sends
BEGUN = 45  # not 0: choices have been drawn
VISITED = 46  # address of a word for each state of each machine: whether it was visited; or 0
CONTROL_WORDS = 48
KEPT = (RANDOM, BEGUN, ROUNDS, BASE, ROUND, STARTED, LAST, OVERRUNS, WORST, REFUSED)
"""What a loop takes over from the one whose run it goes on with."""

PAUSE = 2

TOLD, DONE, FULL, ENDED, FAILED, OVERRUN, DECIDED, HANDED = range(1, 9)
"""Reasons to return: told to stop, no turns left, the recording wants room, no process left, a step failed (the
context says how), a turn was late by a period, a monitor became settled, it is
the turn of a process that runs elsewhere."""

BUCKETS = 512
"""Latenesses are counted in eight buckets for each power of two, as in HdrHistogram (G. Tene)."""


def bucket_bounds(number: int) -> tuple[int, int]:
    """The latenesses in nanoseconds that bucket `number` counts: from, to (exclusive)."""
    if number < 8:
        return number, number + 1
    octave, part = divmod(number, 8)
    width = 1 << (octave - 1)
    return (8 + part) * width, (9 + part) * width


def words(count: int) -> ctypes.Array[ctypes.c_int64]:
    """So many 64-bit words, all 0, which stay the same ones in a process that is forked later."""
    size = max(1, count) * 8
    return (ctypes.c_int64 * count).from_buffer(mmap.mmap(-1, size))


def store(numbers: Iterable[int], array: ctypes.Array[ctypes.c_int64], at: int = 0) -> None:
    """Write numbers to an array, from the word `at` on."""
    given: list[ctypes.c_int64 | int] = [*numbers]
    array[at : at + len(given)] = given
