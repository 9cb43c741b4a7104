"""A stream that is never waited for, for what a supervisor says while it is responsible for a run.

A terminal that is stopped (Ctrl-S), or a pipe that nobody reads, would hold the supervisor in a write otherwise, and a
signal could no longer bring outputs to their safe values.
"""

from __future__ import annotations

import io
import os
import select
import socket
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO, cast

MOST_WAITING = 1 << 18
"""Bytes that wait until they can be written; what comes then is left out."""
LAST = 1.0
"""Seconds in which what waits at the end must be taken."""


class Unhurried(io.TextIOBase):
    """Writes to the file of a stream, as far as that can be done at once; the rest waits for the next call.

    Files are always written at once, and so are streams without a descriptor.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._waiting = b""
        self._own: int | None = None
        """A description of its own of the same terminal or pipe, in which no write waits."""
        self._socket: socket.socket | None = None
        with suppress(OSError, ValueError):
            descriptor = stream.fileno()
            kind = os.fstat(descriptor).st_mode
            if stat.S_ISSOCK(kind):
                self._socket = socket.socket(fileno=os.dup(descriptor))
            elif stat.S_ISFIFO(kind) or os.isatty(descriptor):
                flags = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
                self._own = os.open(f"/proc/self/fd/{descriptor}", flags)

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
        if self._own is None and self._socket is None:
            self._stream.write(text)
            self._stream.flush()
        elif len(self._waiting) < MOST_WAITING:
            self._waiting += text.encode(self.encoding, "backslashreplace")
            self.flush()
        return len(text)

    def flush(self) -> None:
        """Write what waits, as far as that can be done now; what nobody can read any more is left out."""
        try:
            while self._waiting:
                if self._socket is not None:
                    sent = self._socket.send(self._waiting, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
                elif self._own is not None:
                    sent = os.write(self._own, self._waiting)
                else:
                    sent = len(self._waiting)  # it is closed
                self._waiting = self._waiting[sent:]
        except BlockingIOError:
            pass
        except OSError:
            self._waiting = b""

    @property
    def waits(self) -> bool:
        """Whether something has not been written yet."""
        return bool(self._waiting)

    def close(self) -> None:
        """Write what waits, for a second at most; the stream itself stays open."""
        until = time.monotonic() + LAST
        self.flush()
        while self._waiting and (left := until - time.monotonic()) > 0:
            select.select([], [self._stream], [], left)
            self.flush()
        self._waiting = b""
        if self._own is not None:
            os.close(self._own)
            self._own = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None
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
