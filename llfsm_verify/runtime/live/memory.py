"""Memory that a run shares with the processes that it forks."""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Iterable


def words(count: int) -> ctypes.Array[ctypes.c_int64]:
    """So many 64-bit words, all 0, which stay the same ones in a process that is forked later."""
    size = max(1, count) * 8
    return (ctypes.c_int64 * count).from_buffer(mmap.mmap(-1, size))


def store(numbers: Iterable[int], array: ctypes.Array[ctypes.c_int64], at: int = 0) -> None:
    """Write numbers to an array, from the word `at` on."""
    given: list[ctypes.c_int64 | int] = [*numbers]
    array[at : at + len(given)] = given
