"""Memory that grows without being copied or touched before it is needed: anonymous mappings."""

from __future__ import annotations

import ctypes
import errno
import mmap
from collections.abc import Iterator
from contextlib import contextmanager

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
