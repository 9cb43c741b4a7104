"""Which product nodes have been found: a sparse store numbers them by open addressing, a dense one is indexed."""

from __future__ import annotations

from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.kernels.words import helper, kernel, load32, load64, shifted, store32, store64

GOLDEN = -7046029254386353131
"""2^64 divided by the golden ratio: D. Knuth, The Art of Computer Programming 3, 6.4, multiplicative hashing."""


@helper
def look_up(slots: int, shift: int, keys: int, key: int) -> int:
    """The number of a product node; when there is none, ``-1 - i`` for the free slot i where it belongs."""
    mask = (1 << (64 - shift)) - 1
    i = shifted((key ^ shifted(key, 29)) * GOLDEN, shift)
    while True:
        slot = load32(slots, i)
        if slot == 0:
            return -1 - i
        if load64(keys, slot - 1) == key:
            return slot - 1
        i = (i + 1) & mask


@helper
def is_accepting(block: int, key: int) -> bool:
    """Whether the search for components has marked the product node that this one stands for."""
    bases, marks, slots = (load64(block, p.BASES), load64(block, p.OTHER_MARKS), load64(block, p.OTHER_SLOTS))
    state, node = key >> 32, key & p.NODE
    if bases != 0:
        state = load32(bases, state)
    if slots == 0:
        if state >= load64(block, p.OTHER_STATES):
            return False
        return load32(marks, state * load64(block, p.NODES) + node) == p.ACCEPTING
    at = look_up(slots, load64(block, p.OTHER_SHIFT), load64(block, p.OTHER_KEYS), state << 32 | node)
    return at >= 0 and load32(marks, at) == p.ACCEPTING


@kernel("product_rehash")
def rehash(block: int) -> int:
    """Enter product nodes, by number, into a new table of a sparse store, or into a dense store of single bits."""
    slots, shift, keys = (load64(block, p.SLOTS), load64(block, p.SHIFT), load64(block, p.KEYS))
    bits, nodes = load64(block, p.MARKS), load64(block, p.NODES)
    for number in range(load64(block, p.ENTER_BEGIN), load64(block, p.ENTER_END)):
        if slots == 0:
            key = load64(keys, number)
            bit = (key >> 32) * nodes + (key & p.NODE)
            store64(bits, bit >> 6, load64(bits, bit >> 6) | 1 << (bit & 63))
            continue
        store32(slots, -1 - look_up(slots, shift, keys, load64(keys, number)), number + 1)
    return p.DONE


@kernel("product_thin")
def thin(block: int) -> int:
    """Give the product nodes in a part of a dense store of marks numbers in a sparse one.

    The block holds the sparse store, at first empty and with COUNT 0, large enough, and in STARTS the dense marks.
    """
    slots, shift, keys = (load64(block, p.SLOTS), load64(block, p.SHIFT), load64(block, p.KEYS))
    marks, dense, nodes = (load64(block, p.MARKS), load64(block, p.STARTS), load64(block, p.NODES))
    count = load64(block, p.COUNT)
    for i in range(load64(block, p.ENTER_BEGIN), load64(block, p.ENTER_END)):
        mark = load32(dense, i)
        if mark != 0:
            key = (i // nodes) << 32 | (i % nodes)
            store32(slots, -1 - look_up(slots, shift, keys, key), count + 1)
            store64(keys, count, key)
            store32(marks, count, mark)
            count += 1
    store64(block, p.COUNT, count)
    return p.DONE
