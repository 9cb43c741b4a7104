"""The Python side of an exact set of vectors of words (`kernels.sets`): its memory and its growth."""

from __future__ import annotations

import ctypes

from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.memory import Region

MAX_LOAD = 0.75
"""Vectors per slot of the table at which it doubles: then 8 bytes a slot are 11 to 21 bytes a vector."""
STRETCHED_LOAD = 0.85
"""Vectors per slot for what must be finished when there is no memory to grow."""
SLOT_BYTES = 8
KEPT = 1 << 12
"""Slots at the beginning of a table that are put aside while it grows: a slot may go to where others still are, or have
gone around the end."""
PASSED_EACH = 16
"""Slots in use that may be passed for each vector of a restored set: on average two or three are."""
REBUILD_PORTION = 1 << 20
"""Vectors entered, or slots moved, in one call, so that Ctrl-C is served."""


class VectorSet:
    """Vectors of `words` 64-bit words, numbered in the order of insertion; kernels insert through `address`."""

    def __init__(self, kernels: Kernels, words: int, keys: Region, slots: int = 1 << 10) -> None:
        self._kernels = kernels
        self.words = words
        self.keys = keys
        self.slots = slots
        self._table = Region(slots * SLOT_BYTES)
        self._block = (ctypes.c_int64 * 10)()
        self._place()

    @property
    def address(self) -> int:
        """Of the set's control block."""
        return ctypes.addressof(self._block)

    @property
    def count(self) -> int:
        return self._block[b.SET_COUNT]

    @property
    def limit(self) -> int:
        """The set must grow before it has more vectors than this."""
        return self._block[b.SET_LIMIT]

    @property
    def table_bytes(self) -> int:
        return self.slots * SLOT_BYTES

    def add_all(self, vectors: bytes) -> None:
        """Insert vectors that are pairwise different and not in the set."""
        before, more = self.count, len(vectors) // (8 * self.words)
        while before + more > self.limit:
            self.grow()
        self.keys.write(vectors, before * 8 * self.words)
        self._block[b.SET_COUNT] = before + more
        self._place()
        self._enter(before)

    def restore(self, count: int) -> bool:
        """The first `count` vectors of `keys`, which somebody has put there, become the set; false when two of them are
        equal, or they were chosen so that looking them up takes long. The set must then not be used any more."""
        self._block[b.SET_COUNT] = 0
        ctypes.memset(self._table.address, 0, self.slots * SLOT_BYTES)
        while self.limit <= count:
            self.grow()
        self._block[b.SET_COUNT] = count
        self._block[b.REBUILD_PASSED] = PASSED_EACH * (count + self.slots)
        return self._enter(0, "enter_distinct")

    def grow(self) -> None:
        """Double the table, in place."""
        old = self.slots
        kept = min(old, KEPT)
        first = Region(kept * SLOT_BYTES)
        first.write(self._table.read(0, kept * SLOT_BYTES))
        self.slots = 2 * old
        self._table.grow(self.slots * SLOT_BYTES)
        self._place()
        fits = True
        for end in range(old, kept, -REBUILD_PORTION):
            fits = fits and self._move("spread", self._table.address, max(kept, end - REBUILD_PORTION), end)
        if fits:
            ctypes.memset(self._table.address, 0, kept * SLOT_BYTES)
            self._move("rehash", first.address, 0, kept)
        else:
            ctypes.memset(self._table.address, 0, self.slots * SLOT_BYTES)
            self._enter(0)
        first.close()

    def _move(self, kernel: str, source: int, start: int, end: int) -> bool:
        """Move slots from an address into the table; false when that cannot be done."""
        block = self._block
        request = (ctypes.c_int64 * 6)(source, start, end, self._table.address, block[b.SET_MASK], block[b.SET_SHIFT])
        return self._kernels.run(kernel, ctypes.addressof(request)) == b.DONE

    def stretch(self) -> None:
        """Allow some more vectors without growing, until the set grows."""
        self._place(STRETCHED_LOAD)

    def _place(self, load: float = MAX_LOAD) -> None:
        block, limit = self._block, int(self.slots * load)
        self.keys.grow(limit * self.words * 8)
        block[b.SET_KEYS], block[b.SET_TABLE] = self.keys.address, self._table.address
        block[b.SET_MASK], block[b.SET_LIMIT] = self.slots - 1, limit
        block[b.SET_SHIFT] = 65 - self.slots.bit_length()
        block[b.REBUILD_WORDS] = self.words

    def _enter(self, start: int, kernel: str = "rebuild") -> bool:
        block = self._block
        for first in range(start, self.count, REBUILD_PORTION):
            block[b.REBUILD_START], block[b.REBUILD_END] = first, min(first + REBUILD_PORTION, self.count)
            if self._kernels.run(kernel, self.address) != b.DONE:
                return False
        return True

    def close(self) -> None:
        """Give the table's memory back; the vectors stay."""
        self._table.close()
