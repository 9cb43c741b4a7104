"""Standard error that cannot be written (its reader has gone, the disk is full), on which no exit code depends; and for
what a supervisor says while it is responsible for a run, a stream that is never waited for.

A terminal that is stopped (Ctrl-S), or a pipe that no one reads, would hold the supervisor in a write otherwise, and a
signal could no longer bring outputs to their safe values.
"""

from __future__ import annotations

import io
import os
import select
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, TextIO, cast

if TYPE_CHECKING:
    from typing_extensions import Buffer


class _Dropping(io.FileIO):
    def write(self, data: Buffer, /) -> int:
        """Write what can be written; all counts as written."""
        try:
            written = super().write(data)
        except OSError:
            written = None
        return memoryview(data).nbytes if written is None else written


def drop_what_no_one_reads() -> None:
    """From now on a failure to write to the standard error of this process is no error."""
    stream = sys.__stderr__
    if stream is None or sys.stderr is not stream:
        return
    raw = _Dropping(stream.fileno(), "w", closefd=False)
    encoding = stream.encoding
    sys.stderr = io.TextIOWrapper(io.BufferedWriter(raw), encoding, errors="backslashreplace", line_buffering=True)


MOST_WAITING = 1 << 18
"""Bytes that wait until they can be written; what comes then is left out."""
PIECE, SOCKET_PIECE, TERMINAL_PIECE = select.PIPE_BUF, 1024, 1
"""Bytes that a pipe, a socket with the least buffer, and a terminal take at once when `poll` says that they take some.
Of a terminal's last 256 bytes a line may take all at once.
"""
LAST = 1.0
"""Seconds in which what waits at the end must be taken."""


class Unhurried(io.TextIOBase):
    """Writes to the terminal, pipe or socket of a stream, as far as that can be done at once; the rest waits for the
    next call. All else (files, streams without a descriptor) is written at once.

    It writes to a description of its own, in which no write waits, where it can be opened: that of a socket cannot, nor
    that of a terminal or a pipe of another user. To the stream's own it writes so little at a time that this is done at
    once, unless another process fills it, or stops the terminal, in the very moment.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._waiting = bytearray()
        self._to = self._own = -1
        self._piece = PIECE
        self._poll = select.poll()
        with suppress(OSError, ValueError):
            descriptor = stream.fileno()
            kind = os.fstat(descriptor).st_mode
            if not (stat.S_ISFIFO(kind) or stat.S_ISSOCK(kind) or os.isatty(descriptor)):
                return
            self._to = descriptor
            self._piece = PIECE if stat.S_ISFIFO(kind) else SOCKET_PIECE if stat.S_ISSOCK(kind) else TERMINAL_PIECE
            with suppress(OSError):
                flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
                self._to = self._own = os.open(f"/proc/self/fd/{descriptor}", flags)
                self._piece = PIECE
            self._poll.register(self._to, select.POLLOUT)

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of the stream."""
        return self._stream.encoding or "utf-8"

    def isatty(self) -> bool:
        """Whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """That of the stream; OSError: it has none."""
        return self._stream.fileno()

    def write(self, text: str) -> int:
        """Write now what can be written, and keep the rest."""
        if self._to < 0:
            self._stream.write(text)
            self._stream.flush()
        elif len(self._waiting) < MOST_WAITING:
            self._waiting += text.encode(self.encoding, "backslashreplace")
            self.flush()
        return len(text)

    def flush(self) -> None:
        """Write what waits, as far as that can be done now; what no one can read any more is left out."""
        try:
            while self._waiting and self._poll.poll(0):
                del self._waiting[: os.write(self._to, self._waiting[: self._piece])]
        except BlockingIOError:
            pass
        except OSError:
            self._waiting.clear()

    @property
    def waits(self) -> bool:
        """Whether something has not been written yet."""
        return bool(self._waiting)

    def close(self) -> None:
        """Write what waits, for a second at most; the stream itself stays open."""
        until = time.monotonic() + LAST
        self.flush()
        while self._waiting and (left := until - time.monotonic()) > 0:
            self._poll.poll(1000 * left)
            self.flush()
        self._waiting.clear()
        if self._own >= 0:
            os.close(self._own)
        self._to = self._own = -1
        super().close()


@contextmanager
def unhurried_errors() -> Iterator[None]:
    """Nothing that is said on standard error is waited for."""
    said, sys.stderr = sys.stderr, cast(TextIO, Unhurried(sys.stderr))
    try:
        yield
    finally:
        own, sys.stderr = sys.stderr, said
        own.close()
