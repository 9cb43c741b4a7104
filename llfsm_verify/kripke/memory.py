"""Memory that grows without being copied or touched before it is needed: anonymous mappings, and in them the exact sets
of vectors of words that kernels search (`kernels.sets`).
"""

from __future__ import annotations

import ctypes
import errno
import mmap
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.limits import LimitReached

PAGE = mmap.PAGESIZE
HUGE = 1 << 21
"""Mappings of at least this many bytes ask for large pages: a table that is read at random then misses the address
translation cache far less."""


class OutOfMemory(LimitReached, MemoryError):
    """The operating system gives no more memory: a limit for a search that has something to tell by then, and for
    everybody else what Python raises in this case."""


class Region:
    """A mapping of zeros; `address` changes when it grows. `size` is in bytes, of which only touched pages count.

    Raises OutOfMemory, also when it grows or is read; what was there is then still there.
    """

    def __init__(self, size: int) -> None:
        self.size = _rounded(size)
        self._map = _mapping(self.size)
        self.address = _address(self._map)

    def grow(self, size: int) -> None:
        """Make room for at least `size` bytes; what is there stays, the new part is zeros."""
        size = _rounded(size)
        if size <= self.size:
            return
        try:
            with _refusals(size):
                self._map.resize(size)
        except SystemError:  # no mremap on this system
            larger = _mapping(size)
            ctypes.memmove(_address(larger), self.address, self.size)
            self._map.close()
            self._map = larger
        _advise(self._map, size)
        self.size = size
        self.address = _address(self._map)

    def read(self, offset: int, size: int) -> bytes:
        """`size` bytes from `offset` on."""
        try:  # not `_refusals`, which takes longer than reading a few words
            return self._map[offset : offset + size]
        except MemoryError:
            raise _refused(size) from None

    def write(self, data: bytes, offset: int = 0) -> None:
        """Put `data` there, growing when it does not fit."""
        self.grow(offset + len(data))
        self._map[offset : offset + len(data)] = data

    def view(self, size: int) -> memoryview:
        """The first `size` bytes. Release it before the region grows."""
        return memoryview(self._map)[:size]

    def close(self) -> None:
        """Give the memory back. The region must not be used any more."""
        self._map.close()
        self.address = 0


@contextmanager
def _refusals(size: int) -> Iterator[None]:
    try:
        yield
    except MemoryError:
        pass
    except OSError as error:
        if error.errno not in (errno.ENOMEM, errno.EAGAIN):  # EAGAIN: locked memory (mlockall, RLIMIT_MEMLOCK)
            raise
    else:
        return
    raise _refused(size)


def _refused(size: int) -> OutOfMemory:
    return OutOfMemory(f"the operating system gives no more memory ({size / 2**20:,.1f} MiB were asked for)")


def _rounded(size: int) -> int:
    return max(PAGE, -(-size // PAGE) * PAGE)


def _mapping(size: int) -> mmap.mmap:
    flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)
    with _refusals(size):
        made = mmap.mmap(-1, size, flags=flags)
    _advise(made, size)
    return made


def _advise(made: mmap.mmap, size: int) -> None:
    advice = getattr(mmap, "MADV_HUGEPAGE", None)
    if size >= HUGE and advice is not None:
        try:
            made.madvise(advice)
        except OSError:  # a kernel without large pages
            return


def _address(made: mmap.mmap) -> int:
    first = ctypes.c_char.from_buffer(made)
    try:
        return ctypes.addressof(first)
    finally:
        del first  # an exported buffer would forbid resizing


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
    def table(self) -> int:
        """The address of the table."""
        return self._table.address

    @property
    def table_bytes(self) -> int:
        return self.slots * SLOT_BYTES

    def add(self, more: int) -> None:
        """So many vectors more have been entered, and lie behind the others."""
        self._block[b.SET_COUNT] += more

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
        """The first `count` vectors of `keys`, which the caller put there, become the set; false when two of them are
        equal, or they were chosen so that looking them up takes long. The set must then not be used any more."""
        self._block[b.SET_COUNT] = 0
        ctypes.memset(self._table.address, 0, self.slots * SLOT_BYTES)
        while self.limit <= count:
            self.grow()
        self._block[b.SET_COUNT] = count
        self._block[b.REBUILD_PASSED] = PASSED_EACH * (count + self.slots)
        return self._enter(0, "enter_distinct")

    def grow(self, spread: Callable[[VectorSet, int], int] | None = None) -> None:
        """Double the table, in place; `spread` may move slots from the end on, and gives the slot before which those
        end that are left."""
        old = self.slots
        kept = min(old, KEPT)
        first = Region(kept * SLOT_BYTES)
        first.write(self._table.read(0, kept * SLOT_BYTES))
        self.slots = 2 * old
        self._table.grow(self.slots * SLOT_BYTES)
        self._place()
        fits, left = True, old if spread is None else spread(self, old)
        for end in range(left, kept, -REBUILD_PORTION):
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
