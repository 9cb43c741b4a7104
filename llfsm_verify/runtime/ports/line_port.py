"""A port that reads and writes lines of JSON at the ends of streams, without ever waiting for the other side."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator, Mapping

from llfsm_verify.runtime.ports.ends import End
from llfsm_verify.runtime.ports.lines import MOST_BYTES, LineReader, Malformed, decode, encode
from llfsm_verify.runtime.ports.port import Link, Unopened
from llfsm_verify.values import Shown

PIECE = select.PIPE_BUF
"""Bytes of one write."""


class _Side:
    """A descriptor at an end, and when to try to open it again."""

    def __init__(self, end: End) -> None:
        self._end = end
        self.descriptor = end.open()
        self._next = 0.0

    @property
    def returns(self) -> bool:
        return self._end.returns

    def opened(self, now: float) -> bool:
        """Try to open it again, if it is time; whether that has worked."""
        if self.descriptor is not None or not self._end.returns or now < self._next:
            return False
        self._next = now + self._end.retry
        try:
            self.descriptor = self._end.open()
        except Unopened:
            return False
        return self.descriptor is not None

    def renew(self, now: float) -> None:
        """The other side is gone."""
        assert self.descriptor is not None
        self._next = now + self._end.retry
        self.descriptor = self._end.renew(self.descriptor)

    def close(self) -> None:
        if self.descriptor is not None:
            os.close(self.descriptor)
            self.descriptor = None
        self._end.close()


class LinePort:
    """Lines in, lines out; each side may be missing. Of what cannot be written yet only the newest is kept."""

    every_frame = False

    def __init__(self, link: Link, reading: End | None, writing: End | None) -> None:
        self._link = link
        self._lines = LineReader()
        self._reading = None if reading is None else _Side(reading)
        try:
            both = reading is writing and self._reading is not None
            self._writing = self._reading if both else None if writing is None else _Side(writing)
        except BaseException:
            self.close()
            raise
        self._begun = b""
        """What is left of a line of which something is written."""
        self._newest: bytes | None = None
        """What is to be written after it."""
        self._last: bytes | None = None
        """The last line that was begun."""

    def waits(self) -> Iterator[tuple[int, int]]:
        """See `Port`."""
        reading, writing = self._descriptors()
        output = select.POLLOUT if self._begun or self._newest is not None else 0
        if reading is not None:
            yield reading, select.POLLIN | (output if writing == reading else 0)
        if writing is not None and writing != reading and output:
            yield writing, output

    def _descriptors(self) -> tuple[int | None, int | None]:
        reading = None if self._reading is None else self._reading.descriptor
        return reading, None if self._writing is None else self._writing.descriptor

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        """See `Port`."""
        reading, writing = self._descriptors()
        if reading is not None and reading in ready and ready[reading] & ~select.POLLOUT:
            self._read(reading, now)
        elif self._reading is not None and self._reading.opened(now) and self._reading is self._writing:
            self._restart()
        if self._writing is None:
            return
        if writing is not None and writing == self._writing.descriptor and ready.get(writing, 0) & ~select.POLLIN:
            self._write(writing, now)
        elif self._writing.opened(now):
            self._restart()

    def _read(self, descriptor: int, now: float) -> None:
        assert self._reading is not None
        why = "the writer has closed it"
        try:
            data = os.read(descriptor, MOST_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            data, why = b"", error.strerror or "it cannot be read"
        for line in self._lines.lines(data):
            self._message(line)
        if not data:
            if self._lines.restart():
                self._link.malformed("a line has no end")
            self._reading.renew(now)
            self._link.lost(why, forever=not self._reading.returns)

    def _message(self, line: bytes | None) -> None:
        if line is None:
            self._link.malformed(f"a line is longer than {MOST_BYTES:,} bytes")
        elif line.strip():
            try:
                self._link.take(decode(line))
            except Malformed as problem:
                self._link.malformed(str(problem))

    def send(self, values: Mapping[str, Shown]) -> None:
        """See `Port`."""
        if self._writing is None:
            return
        gone = self._writing.descriptor is None and not self._writing.returns
        if self._newest is not None or gone:
            absent = self._writing.descriptor is None
            self._link.unsent("nobody reads it" if absent else "it is not read as fast as it changes")
        self._newest = None if gone else encode(values)

    def _write(self, descriptor: int, now: float) -> None:
        assert self._writing is not None
        if not self._begun and self._newest is not None:
            self._begun = self._last = self._newest
            self._newest = None
        try:
            self._begun = self._begun[os.write(descriptor, self._begun[:PIECE]) :]
        except BlockingIOError:
            return
        except OSError as error:
            self._writing.renew(now)
            if self._reading is self._writing:
                self._link.lost(error.strerror or "it cannot be written", forever=not self._writing.returns)
            if self._writing.descriptor is None and not self._writing.returns:
                self._link.unsent("nobody reads it")
                self._begun, self._newest, self._last = b"", None, None
            else:
                self._restart()
            return
        if not self._begun:
            self._link.sent()

    def _restart(self) -> None:
        """Somebody else reads: what is newest, from its begin."""
        self._newest = self._newest or self._last
        self._begun = b""

    @property
    def flushed(self) -> bool:
        """See `Port`."""
        return not self._begun and self._newest is None

    def close(self) -> None:
        """See `Port`."""
        for side in (self._reading, getattr(self, "_writing", None)):
            if side is not None:
                side.close()
