"""Exact sets of vectors of 64-bit words, numbered in the order of insertion.

Open addressing: a search looks at the eight slots of a cache line, then at those of the next one (`following`), since
another line is another wait for memory. A slot is 64 bits: 1 + the number in the low half (0: free) and the high half
of the hash value, so that vectors are compared only when they are very likely equal. A vector's slot is given by the
highest bits of its hash value: the slots of a table twice as large are then in the same order, and a table is spread
out in place by a walk that misses no cache and touches no fresh memory but the new half. Vectors lie one behind the
other in the order of their numbers, which is also the queue of a breadth-first search.
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
def equal(a: int, b: int, words: int) -> bool:
    for i in range(words):
        if load64(a, i) != load64(b, i):
            return False
    return True


@helper
def following(i: int, first: int, mask: int) -> int:
    """The slot at which a search that began at `first` looks after slot i."""
    i = (i & ~7) | (i + 1) & 7
    return i if (i ^ first) & 7 else (i + 8) & mask


@helper
def foresee(table: int, mask: int, first: int, keys: int, h: int, words: int) -> int:
    """The slot up to which a search for hash value `h` passes only other ones; what it needs there is asked for."""
    i = first
    while True:
        slot = load64(table, i)
        if slot == 0:
            return i
        if (slot ^ h) & ~LOW == 0:
            prefetch(keys + ((slot & LOW) - 1) * words * 8)
            return i
        i = following(i, first, mask)
        if (i ^ first) & 7 == 0:
            prefetch(table + i * 8)
            return i


@helper
def enter(
    table: int, mask: int, first: int, i: int, keys: int, count: int, vector: int, h: int, words: int
) -> int:  # fmt: skip
    """The number of a vector in a set of `count`: `count` when it is new; then it is there. There must be room.

    The search begins at slot `first`, and goes on from slot i.
    """
    while True:
        slot = load64(table, i)
        if slot == 0:
            for k in range(words):
                store64(keys, count * words + k, load64(vector, k))
            store64(table, i, (h & ~LOW) | (count + 1))
            return count
        if (slot ^ h) & ~LOW == 0:
            number = (slot & LOW) - 1
            if equal(keys + number * words * 8, vector, words):
                return number
        i = following(i, first, mask)


@helper
def insert(block: int, vector: int, h: int, words: int) -> int:
    """The number of a vector; the caller sees that it is new from the count. There must be room."""
    table, mask, keys = load64(block, b.SET_TABLE), load64(block, b.SET_MASK), load64(block, b.SET_KEYS)
    count = load64(block, b.SET_COUNT)
    first = shifted(h, load64(block, b.SET_SHIFT))
    number = enter(table, mask, first, first, keys, count, vector, h, words)
    if number == count:
        store64(block, b.SET_COUNT, count + 1)
    return number


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
        i = first = shifted(h, shift)
        while load64(table, i) != 0:
            i = following(i, first, mask)
        store64(table, i, (h & ~LOW) | (n + 1))
    return b.DONE


@kernel("rehash")
def rehash(block: int) -> int:
    """Move slots from elsewhere into a table."""
    old, table = load64(block, b.REHASH_OLD), load64(block, b.REHASH_TABLE)
    mask, shift = load64(block, b.REHASH_MASK), load64(block, b.REHASH_SHIFT)
    for n in range(load64(block, b.REHASH_START), load64(block, b.REHASH_END)):
        slot = load64(old, n)
        if slot != 0:
            i = first = shifted(slot, shift)
            while load64(table, i) != 0:
                i = following(i, first, mask)
            store64(table, i, slot)
    return b.DONE


@kernel("spread")
def spread(block: int) -> int:
    """Move slots, the last one first, to where they belong in a table that has become twice as large in place.

    A slot goes to a line behind where it was, into what has been moved already: b.BROKEN when one does not, because it
    stood too far behind where its search begins. Then the table has to be made anew.
    """
    table, mask, shift = load64(block, b.REHASH_TABLE), load64(block, b.REHASH_MASK), load64(block, b.REHASH_SHIFT)
    start, end = load64(block, b.REHASH_START), load64(block, b.REHASH_END)
    for back in range(end - start):
        n = end - 1 - back
        slot = load64(table, n)
        if slot != 0:
            i = first = shifted(slot, shift)
            if i <= n | 7:
                return b.BROKEN
            store64(table, n, 0)
            while load64(table, i) != 0:
                i = following(i, first, mask)
            store64(table, i, slot)
    return b.DONE
