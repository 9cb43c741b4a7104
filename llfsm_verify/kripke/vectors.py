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
        self._block = (ctypes.c_int64 * 9)()
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

    def restore(self, count: int) -> None:
        """The first `count` vectors of `keys`, which somebody has put there, become the set."""
        self._block[b.SET_COUNT] = 0
        ctypes.memset(self._table.address, 0, self.slots * SLOT_BYTES)
        while self.limit <= count:
            self.grow()
        self._block[b.SET_COUNT] = count
        self._enter(0)

    def grow(self) -> None:
        """Double the table: move the slots of the old one, which is in the same order."""
        old, slots = self._table, self.slots
        self._table, self.slots = Region(2 * slots * SLOT_BYTES), 2 * slots
        self._place()
        block = self._block
        for start in range(0, slots, REBUILD_PORTION):
            end = min(start + REBUILD_PORTION, slots)
            request = (ctypes.c_int64 * 6)(
                old.address, start, end, self._table.address, block[b.SET_MASK], block[b.SET_SHIFT]
            )  # fmt: skip
            self._kernels.run("rehash", ctypes.addressof(request))
        old.close()

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

    def _enter(self, start: int) -> None:
        block = self._block
        for first in range(start, self.count, REBUILD_PORTION):
            block[b.REBUILD_START], block[b.REBUILD_END] = first, min(first + REBUILD_PORTION, self.count)
            self._kernels.run("rebuild", self.address)

    def close(self) -> None:
        """Give the table's memory back; the vectors stay."""
        self._table.close()
