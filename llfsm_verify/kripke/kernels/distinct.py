"""Entering vectors that were read from a file into a set: they may be equal, or have been chosen to collide."""

from __future__ import annotations

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels.sets import AHEAD, LOW, equal, following, hashed
from llfsm_verify.kripke.kernels.words import helper, kernel, load64, prefetch, shifted, store64


@helper
def find_free(table: int, mask: int, shift: int, keys: int, vector: int, h: int, words: int, most: int) -> int:
    """The free slot where a vector belongs; -1 when it is in the set, or there is none within `most` slots."""
    i = first = shifted(h, shift)
    passed = 0
    slot = load64(table, i)
    while slot != 0:
        if passed == most:
            return -1
        if (slot ^ h) & ~LOW == 0 and equal(keys + ((slot & LOW) - 1) * words * 8, vector, words):
            return -1
        passed += 1
        i = following(i, first, mask)
        slot = load64(table, i)
    return i


@kernel("enter_distinct")
def enter_distinct(block: int) -> int:
    """Enter vectors as `rebuild` does; b.BROKEN when two are equal, or more slots are passed than may be."""
    words, start, end = load64(block, b.REBUILD_WORDS), load64(block, b.REBUILD_START), load64(block, b.REBUILD_END)
    table, mask, keys = load64(block, b.SET_TABLE), load64(block, b.SET_MASK), load64(block, b.SET_KEYS)
    shift, left = load64(block, b.SET_SHIFT), load64(block, b.REBUILD_PASSED)
    for n in range(start, min(start + AHEAD, end)):
        prefetch(table + shifted(hashed(keys + n * words * 8, words), shift) * 8)
    for n in range(start, end):
        if n + AHEAD < end:
            prefetch(table + shifted(hashed(keys + (n + AHEAD) * words * 8, words), shift) * 8)
        vector = keys + n * words * 8
        h = hashed(vector, words)
        i = find_free(table, mask, shift, keys, vector, h, words, left)
        if i < 0:
            return b.BROKEN
        first = shifted(h, shift)
        left -= (((i & ~7) - (first & ~7)) & mask) + ((i - first) & 7)
        store64(table, i, (h & ~LOW) | (n + 1))
    store64(block, b.REBUILD_PASSED, left)
    return b.DONE
