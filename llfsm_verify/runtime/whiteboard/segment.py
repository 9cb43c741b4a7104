"""Shared memory for frames: made and written by one process, and read by those to whom it hands a descriptor.

A segment is an anonymous file in memory. Its server maps it and then seals it: no process can change its size any
more, map it for writing, or undo that. The mapping that the server has already stays writable, and so
does one that a process inherits which is forked before the sealing, so nothing is forked in between.
"""

from __future__ import annotations

import ctypes
import fcntl
import mmap
import os
import secrets
import weakref
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import cache

from llfsm_verify.backends.native.machine_code import MachineCode
from llfsm_verify.runtime.live import generations
from llfsm_verify.runtime.live.generations import (
    EPOCH,
    FORMAT_VERSION,
    MAGIC,
    MAGIC_NUMBER,
    PERIOD,
    SERVER,
    VERSION,
    WORDS,
    segment_words,
)  # fmt: skip

F_SEAL_FUTURE_WRITE = 0x10
"""Python 3.11 does not know it."""
FIXED = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW
"""Its size stays."""
SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | F_SEAL_FUTURE_WRITE | fcntl.F_SEAL_SEAL
MOST_WORDS = 1 << 20


class NoSegment(Exception):
    """A descriptor is not of a segment that can be trusted to stay as it is; the message says why."""


class _Code:
    """`publish` and `newest` in machine code, compiled once in a process."""

    def __init__(self) -> None:
        self._code = MachineCode(generations.llvm_text, "thorough", generations.llvm_text())
        pointer, i64 = ctypes.c_void_p, ctypes.c_int64
        address = self._code.address
        self.publish: Callable[..., None] = ctypes.CFUNCTYPE(None, pointer, pointer, i64)(address("publish"))
        self.newest: Callable[..., int] = ctypes.CFUNCTYPE(i64, pointer, pointer, i64)(address("newest"))
        self.word: Callable[..., int] = ctypes.CFUNCTYPE(i64, pointer, i64, i64)(address("word"))
        self.frame: Callable[..., bool] = ctypes.CFUNCTYPE(ctypes.c_bool, pointer, pointer, i64, i64)(address("frame"))


@cache
def code() -> _Code:
    """The machine code of writers and readers."""
    return _Code()


_LIBC = ctypes.CDLL(None, use_errno=True)
_LIBC.mmap.restype, _LIBC.mmap.argtypes = ctypes.c_void_p, (
    ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long,
)  # fmt: skip
_LIBC.munmap.argtypes = (ctypes.c_void_p, ctypes.c_size_t)


class Mapped:
    """Memory of a file at an address. Python's `mmap` would keep a descriptor of its own for each. OSError."""

    def __init__(self, descriptor: int, size: int, access: int) -> None:
        self.address: int = _LIBC.mmap(None, size, access, mmap.MAP_SHARED, descriptor, 0)
        if self.address == ctypes.c_void_p(-1).value:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        self.closed = False
        self._unmap = weakref.finalize(self, _LIBC.munmap, self.address, size)
        self._unmap.atexit = False

    def close(self) -> None:
        """Unmap it."""
        self.closed = True
        self._unmap()


class _Frames:
    """Frames in mapped memory. ValueError of all but `close`: it is unmapped, and machine code that reads or writes
    there would end the process."""

    def __init__(self, descriptor: int, words: int, access: int) -> None:
        self.words = words
        self._mapped = Mapped(descriptor, segment_words(words) * 8, access)

    @property
    def address(self) -> int:
        """Where it is mapped."""
        if self._mapped.closed:
            raise ValueError("the segment is closed")
        return self._mapped.address

    @property
    def latest(self) -> int:
        """The number of the newest frame; 0: there is none yet."""
        return ctypes.c_int64.from_address(self.address + 8 * generations.NEWEST).value

    def newest(self) -> list[int] | None:
        """The newest frame; None: there is none yet."""
        copy = (ctypes.c_int64 * self.words)()
        return list(copy) if code().newest(self.address, copy, self.words) else None

    def frame(self, number: int) -> list[int] | None:
        """The frame of this number; None: there is none yet, or it has been overwritten."""
        copy = (ctypes.c_int64 * self.words)()
        return list(copy) if code().frame(self.address, copy, self.words, number) else None

    def close(self) -> None:
        """Unmap it."""
        self._mapped.close()


class Segment(_Frames):
    """A segment of this process, for frames of so many words. `epoch` tells it from one of an earlier start.

    From then on nothing is compiled to read or write it, in this process and those that it forks.
    `lent`: others who get its descriptor may write it, and no one can change its size.
    """

    def __init__(self, name: str, words: int, period: int = 0, *, lent: bool = False) -> None:
        code()
        self.period = period
        self.epoch = secrets.randbits(63)
        self.descriptor = os.memfd_create(f"llfsm-{name}"[:200], os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.descriptor, segment_words(words) * 8)
            super().__init__(self.descriptor, words, mmap.PROT_READ | mmap.PROT_WRITE)
            header = (ctypes.c_int64 * generations.HEADER_WORDS).from_address(self.address)
            for word, value in (
                (MAGIC, MAGIC_NUMBER), (VERSION, FORMAT_VERSION), (WORDS, words), (EPOCH, self.epoch),
                (SERVER, os.getpid()), (PERIOD, period),
            ):  # fmt: skip
                header[word] = value
            fcntl.fcntl(self.descriptor, fcntl.F_ADD_SEALS, FIXED | fcntl.F_SEAL_SEAL if lent else SEALS)
        except OSError:
            os.close(self.descriptor)
            raise

    def publish(self, frame: Sequence[int]) -> None:
        """Make a frame the newest one; its first word is its number, one more than that of the last."""
        code().publish(self.address, (ctypes.c_int64 * self.words)(*frame), self.words)

    def close(self) -> None:
        """Others keep what they have; the loop must not use the segment any more."""
        if not self._mapped.closed:  # else the number may be another file's descriptor by now
            super().close()
            os.close(self.descriptor)


class Attached(_Frames):
    """A segment of another process, mapped for reading.

    NoSegment: the descriptor is not one of a sealed segment, or of another version.
    """

    def __init__(self, descriptor: int) -> None:
        try:
            seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
        except OSError:
            raise NoSegment("it is not memory that can be sealed") from None
        if seals & SEALS != SEALS:
            raise NoSegment("its server may still change its size")
        size = os.fstat(descriptor).st_size
        if size < generations.HEADER_WORDS * 8:
            raise NoSegment("it has no header")
        with closing(Mapped(descriptor, generations.HEADER_WORDS * 8, mmap.PROT_READ)) as head:
            header: list[int] = [*(ctypes.c_int64 * generations.HEADER_WORDS).from_address(head.address)]
        if header[MAGIC] != MAGIC_NUMBER or header[VERSION] != FORMAT_VERSION:
            raise NoSegment("it is not a whiteboard of this version")
        words, self.epoch, self.server, self.period = (header[i] for i in (WORDS, EPOCH, SERVER, PERIOD))
        if not 1 <= words <= MOST_WORDS or segment_words(words) * 8 != size:
            raise NoSegment("its size is not that of its frames")
        super().__init__(descriptor, words, mmap.PROT_READ)

    def reader(self, number: int) -> Callable[[], int]:
        """A function that reads one word of the newest frame, which there is. Not to be used after `close`."""
        word, address, words = code().word, self.address, self.words
        return lambda: word(address, words, number)


class Lent(_Frames):
    """A segment of another process that this one writes. NoSegment: the descriptor is not one of a lent segment."""

    def __init__(self, descriptor: int, words: int) -> None:
        try:
            seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
        except OSError:
            raise NoSegment("it is not memory that can be sealed") from None
        if seals & FIXED != FIXED or os.fstat(descriptor).st_size != segment_words(words) * 8:
            raise NoSegment("its size is not that of its frames, or may change")
        super().__init__(descriptor, words, mmap.PROT_READ | mmap.PROT_WRITE)
        self.next = (ctypes.c_int64 * words)()
        """The frame that is being made."""

    def publish(self) -> None:
        """Make the frame the newest one."""
        self.next[0] += 1
        code().publish(self.address, self.next, self.words)
