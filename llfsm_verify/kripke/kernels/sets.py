"""Exact sets of vectors of 64-bit words, numbered in the order of insertion.

Open addressing with linear probing. A slot is 64 bits: 1 + the number in the low half (0: free) and the high half of
the hash value, so that vectors are compared only when they are very likely equal. A vector's slot is given by the
highest bits of its hash value: the slots of a table twice as large are then in the same order, and a table is moved
into a larger one by a walk through both that misses no cache. Vectors lie one behind the other in the order of their
numbers, which is also the queue of a breadth-first search.
"""

from __future__ import annotations

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels.words import helper, kernel, load64, prefetch, shifted, store64

LOW = 0xFFFFFFFF


@helper
def hashed(vector: int, words: int) -> int:
    """A hash value of 64 bits: the finaliser of MurmurHash3 (A. Appleby, 2011), word after word."""
    h = 0x51ED270B2F6A1C35
    for i in range(words):
        h ^= load64(vector, i)
        h = (h ^ shifted(h, 33)) * -49064778989728563
        h = (h ^ shifted(h, 33)) * -4265267296055464877
        h ^= shifted(h, 33)
    return h


@helper
def ask(block: int, h: int) -> None:
    """Prefetch the slot at which a search for hash value `h` begins."""
    prefetch(load64(block, b.SET_TABLE) + shifted(h, load64(block, b.SET_SHIFT)) * 8)


@helper
def ask_vector(block: int, h: int, words: int) -> None:
    """Prefetch the vector with which that slot's hash value agrees, if it does."""
    slot = load64(load64(block, b.SET_TABLE), shifted(h, load64(block, b.SET_SHIFT)))
    if slot != 0 and (slot ^ h) & ~LOW == 0:
        prefetch(load64(block, b.SET_KEYS) + ((slot & LOW) - 1) * words * 8)


@helper
def equal(a: int, b: int, words: int) -> bool:
    for i in range(words):
        if load64(a, i) != load64(b, i):
            return False
    return True


@helper
def insert(block: int, vector: int, h: int, words: int) -> int:
    """The number of a vector; the caller sees that it is new from the count. There must be room."""
    table, mask, keys = load64(block, b.SET_TABLE), load64(block, b.SET_MASK), load64(block, b.SET_KEYS)
    i = shifted(h, load64(block, b.SET_SHIFT))
    while True:
        slot = load64(table, i)
        if slot == 0:
            number = load64(block, b.SET_COUNT)
            for k in range(words):
                store64(keys, number * words + k, load64(vector, k))
            store64(table, i, (h & ~LOW) | (number + 1))
            store64(block, b.SET_COUNT, number + 1)
            return number
        if (slot ^ h) & ~LOW == 0:
            number = (slot & LOW) - 1
            if equal(keys + number * words * 8, vector, words):
                return number
        i = (i + 1) & mask


AHEAD = 16


@kernel("rebuild")
def rebuild(block: int) -> int:
    """Enter vectors of a set into its table, in which they are not yet."""
    words, start, end = load64(block, b.REBUILD_WORDS), load64(block, b.REBUILD_START), load64(block, b.REBUILD_END)
    table, mask, keys = load64(block, b.SET_TABLE), load64(block, b.SET_MASK), load64(block, b.SET_KEYS)
    shift = load64(block, b.SET_SHIFT)
    for n in range(start, min(start + AHEAD, end)):
        prefetch(table + shifted(hashed(keys + n * words * 8, words), shift) * 8)
    for n in range(start, end):
        if n + AHEAD < end:
            prefetch(table + shifted(hashed(keys + (n + AHEAD) * words * 8, words), shift) * 8)
        h = hashed(keys + n * words * 8, words)
        i = shifted(h, shift)
        while load64(table, i) != 0:
            i = (i + 1) & mask
        store64(table, i, (h & ~LOW) | (n + 1))
    return b.DONE


@kernel("rehash")
def rehash(block: int) -> int:
    """Move slots of a table into one that is empty and twice as large."""
    old, table = load64(block, b.REHASH_OLD), load64(block, b.REHASH_TABLE)
    mask, shift = load64(block, b.REHASH_MASK), load64(block, b.REHASH_SHIFT)
    for n in range(load64(block, b.REHASH_START), load64(block, b.REHASH_END)):
        slot = load64(old, n)
        if slot != 0:
            i = shifted(slot, shift)
            while load64(table, i) != 0:
                i = (i + 1) & mask
            store64(table, i, slot)
    return b.DONE
