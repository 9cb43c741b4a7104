"""How a frame gets from its writer to its readers: 64 generations, and the number of the newest published last.

A segment is an array of 64-bit words: 64 of a header, then the generations, each of a stamp and a frame, on cache
lines of their own. Frames are numbered from 1; number n is in generation n mod 64. The stamp of a generation is the
number of its frame, or 0 while that is being written; the word NEWEST is the number of the newest whole frame, or 0. A
writer that is killed at any instruction leaves the newest frame whole, and no reader waits for it. A reader that is
overtaken by 64 frames while it copies one finds another stamp and copies the newest one instead. Who reads frame after
frame finds each of the last ones, and knows by the numbers which it has missed.

Where the writer does not keep to this (others can write a segment that was lent), no reader waits for it either: after
`TRIES` the newest frame counts as none. A writer that keeps to it would have to overtake the reader as often in a row.

Stores and loads of frames are atomic and unordered but for the fences between them and the stamps (H.-J. Boehm, Can
seqlocks get along with programming language memory models?, MSPC 2012).
"""

from __future__ import annotations

from llfsm_verify.backends.native.loops import fill, llvm_source

HEADER_WORDS = 64
GENERATIONS = 64
"""A power of two."""
LINE_WORDS = 8
TRIES = 1 << 16
"""How often a reader looks again for the newest frame."""

# Words of the header.
MAGIC, VERSION, WORDS, EPOCH, SERVER, PERIOD = range(6)
NEWEST = 8  # on a cache line of its own
MAGIC_NUMBER = int.from_bytes(b"llfsm-wb", "little")
FORMAT_VERSION = 2


def stride(words: int) -> int:
    """Words from one generation to the next, for frames of so many."""
    return -(-(words + 1) // LINE_WORDS) * LINE_WORDS


def segment_words(words: int) -> int:
    """Words of a segment for frames of so many."""
    return HEADER_WORDS + GENERATIONS * stride(words)


def llvm_text() -> str:
    """The functions of writers and readers."""
    numbers = {
        "LINE_WORDS": LINE_WORDS, "HEADER_WORDS": HEADER_WORDS, "LAST_GENERATION": GENERATIONS - 1, "NEWEST": NEWEST,
        "TRIES": TRIES,
    }  # fmt: skip
    return fill(llvm_source("llfsm_verify.runtime.live", "generations.ll"), numbers)
