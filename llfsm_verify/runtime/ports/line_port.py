"""A port of lines of JSON, an object each, at the ends of streams: it never waits for the other side."""

from __future__ import annotations

import errno
import json
import os
import select
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol, cast

from llfsm_verify.files import special_kind
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.ports.port import Link, Unopened
from llfsm_verify.values import Shown, text

STANDARD = {"stdin": 0, "stdout": 1, "stderr": 2}
STANDARD_INPUT, STANDARD_OUTPUT = "standard input for reading", "standard output for writing"
"""What ports hold that read the one or write to the other."""
PIPE_HINT = "correct the path, or make a pipe there with `mkfifo`"


class End(Protocol):
    """One end of a stream."""

    retry: float
    """Seconds between two attempts to open it again."""
    returns: bool
    """Whether the other side may come back."""

    def open(self) -> int | None:
        """A descriptor; None: it cannot be opened yet. Unopened: it never can."""

    def renew(self, descriptor: int) -> int | None:
        """The other side is gone: give the descriptor back, for another one if there is one at once."""

    def close(self) -> None:
        """Give back what is not the descriptor."""
        return


class Inherited(End):
    """A descriptor of this process. It belongs to others as well, so its flags stay as they are; a write to it is of
    PIPE_BUF bytes at most, which a pipe that `poll` calls writable takes without waiting (pipe(7)).
    """

    retry = 0.0
    returns = False

    def __init__(self, number: int) -> None:
        self._number = number

    def open(self) -> int | None:
        """See `End`."""
        try:
            return os.dup(self._number)
        except OSError as error:
            why = f"descriptor {self._number}: {error.strerror}"
            raise Unopened(why, "name a descriptor that is open when the run begins") from None

    def renew(self, descriptor: int) -> int | None:
        """See `End`."""
        os.close(descriptor)
        return None


class Named(End):
    """A pipe, device or file with a name. Only of a pipe can the other side come back."""

    retry = 0.0

    def __init__(self, path: str, *, output: bool) -> None:
        self._path = path
        self._flags = os.O_NONBLOCK | os.O_NOCTTY | (os.O_WRONLY | os.O_APPEND if output else os.O_RDONLY)
        self._output = output
        self.returns = False

    def open(self) -> int | None:
        """See `End`."""
        try:
            descriptor = os.open(self._path, self._flags)
        except OSError as error:
            if error.errno == errno.ENXIO and self._output and Path(self._path).is_fifo():
                self.returns = True  # no process reads it yet
                return None
            raise Unopened(f"{self._path}: {error.strerror}", PIPE_HINT) from None
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode) or stat.S_ISBLK(mode):
            os.close(descriptor)
            raise Unopened(f"{self._path}: it is {special_kind(mode)}, and a pipe is expected", PIPE_HINT)
        self.returns = stat.S_ISFIFO(mode)
        return descriptor

    def renew(self, descriptor: int) -> int | None:
        """See `End`."""
        # The new end is there before the old one goes, so that who opens the pipe meanwhile finds a reader.
        try:
            return self.open() if self.returns else None
        except Unopened:
            self.returns = False  # it was removed
            return None
        finally:
            os.close(descriptor)


MOST_BYTES = 1 << 16
"""Of a line, without its end."""


class Malformed(Exception):
    """A line is no message; the message says why."""


class LineReader:
    """Puts lines together. What is longer than MOST_BYTES is passed over, and told once, where it becomes too long."""

    def __init__(self, end: bytes = b"\n") -> None:
        self._end = end
        self._rest = b""
        self._passing = False

    def lines(self, data: bytes) -> Iterator[bytes | None]:
        """The lines that end in `data`, without their ends; None stands for one that is too long."""
        *whole, last = data.split(self._end)
        for piece in whole:
            line, passing = self._rest + piece, self._passing
            self._rest, self._passing = b"", False
            if not passing:
                yield line if len(line) <= MOST_BYTES else None
        self._rest += last
        if self._passing or len(self._rest) > MOST_BYTES:
            if not self._passing:
                yield None
            self._rest, self._passing = b"", True

    def restart(self) -> bool:
        """Begin with another sender; whether the one before left a line without an end."""
        begun = bool(self._rest.strip()) or self._passing
        self._rest, self._passing = b"", False
        return begun


def decode(line: bytes, *, constants: bool = False) -> dict[str, Json]:
    """The object in a line; decimals stay as they are written, as texts. Malformed.

    `constants`: NaN and Infinity are texts too, which no input takes, so that they spoil only their own field.
    """
    try:
        found = json.loads(line.decode("utf-8"), parse_float=str, parse_constant=str if constants else _constant)
    except UnicodeDecodeError:
        raise Malformed("a line is not UTF-8") from None
    except (ValueError, RecursionError):
        raise Malformed("a line is not JSON") from None
    if not isinstance(found, dict):
        raise Malformed('a line is not an object such as {"car": true}')
    return cast(dict[str, Json], found)


class Framing:
    """How messages are put on a stream: each is a line."""

    name, end = "line", b"\n"

    def pack(self, line: bytes) -> bytes:
        """What is written for a line, which has its end."""
        return line

    def unpack(self, piece: bytes) -> bytes:
        """The line, from what came before an `end`; nothing for nothing. Malformed."""
        return piece


LINES = Framing()


def _constant(name: str) -> None:
    raise ValueError(name)


def shown_json(values: Mapping[str, Shown]) -> str:
    """An object of fields, those with dots nested; decimals are written exactly."""
    parts: dict[str, list[tuple[str, Shown]]] = {}
    for name, value in values.items():
        head, _, rest = name.partition(".") if inner(name) else (name, "", "")
        parts.setdefault(head, []).append((rest, value))
    return f"{{{', '.join(f'{json.dumps(head)}: {_part(found)}' for head, found in parts.items())}}}"


def inner(name: str) -> bool:
    """Whether a field is a path into a message: words with dots between them."""
    return "." in name and all(name.split("."))


def _part(found: list[tuple[str, Shown]]) -> str:
    if found[0][0]:
        return shown_json(dict(found))
    value = found[0][1]
    return json.dumps(value) if isinstance(value, str) else text(value)


def encode(values: Mapping[str, Shown]) -> bytes:
    """An object in a line with its end; see `shown_json`."""
    return f"{shown_json(values)}\n".encode()


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

    def __init__(self, link: Link, reading: End | None, writing: End | None, framing: Framing = LINES) -> None:
        self._link, self._framing = link, framing
        self._lines = LineReader(framing.end)
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
                self._link.malformed(f"a {self._framing.name} has no end")
            self._reading.renew(now)
            self._link.lost(why, forever=not self._reading.returns)

    def _message(self, line: bytes | None) -> None:
        try:
            if line is None:
                raise Malformed(f"a {self._framing.name} is longer than {MOST_BYTES:,} bytes")
            text = self._framing.unpack(line)
            if text.strip():
                self._link.take(decode(text))
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
        self._newest = None if gone else self._framing.pack(encode(values))

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
        self._newest = self._newest or (self._last if self._link.repeats else None)
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
