"""The file of a recording: what was run, and how each frame differs from the one before.

    llfsm-verify recording 1
    {"name": …}                      one line of JSON, filled up with spaces so that the next part begins a page
    used                             8 bytes, little endian: how many bytes follow that are whole turns
    entry entry …                    one for each frame

An entry is a sequence of numbers, seven bits a byte, the lowest first, the highest bit set on all bytes but the last;
one with a sign is folded (0, -1, 1, -2, … are 0, 1, 2, 3, …). First come the choices that were prescribed within the
turn: 1 + the number of the choice, the ringlet of the turn (the second one is 1), and the value with its sign; then 0.
Then come the words of the frame that differ from the frame before: how many words further on, and the difference with
its sign, modulo 2^64; then 0. The frame before the first one is all zeros.

The loop appends entries to a mapped part of the file and publishes `used` last: a process that is killed loses the turn
it was in. A file system that is full is noticed when the next part is reserved, before anything is written to it.
"""

from __future__ import annotations

import ctypes
import fcntl
import json
import mmap
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, Self

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.text import largest_entry
from llfsm_verify.runtime.recording.codes import UNREADABLE, UNWRITABLE

MAGIC = b"llfsm-verify recording 1\n"
KIND = b"llfsm-verify recording "
PAGE = mmap.ALLOCATIONGRANULARITY
WINDOW = 1 << 20
"""Bytes that are mapped and reserved at a time, at least."""
WORD = 8
MOST_HEADER = 1 << 26
MOST_WORDS = 1 << 20
"""Words of a frame: what a damaged header says beyond that is not believed."""


class Prescription(NamedTuple):
    """A choice that got a value within a turn, before its ringlet `ringlet` (from 1; 0 is the first)."""

    choice: int
    ringlet: int
    value: int


@dataclass(frozen=True, slots=True)
class Turn:
    """One entry: what was prescribed within the turn, and the frame at its end."""

    prescribed: tuple[Prescription, ...]
    frame: tuple[int, ...]


class Recorder:
    """Lets a loop append to a new file. Use it before the loop's first frame, and `grow` whenever it wants room.

    A process that is forked after it is made appends after it has called `reach`.
    DiagnosticError (E480): the file is there already, or cannot be written.
    """

    def __init__(self, path: str | Path, header: Mapping[str, Json], loop: Loop) -> None:
        self.path = Path(path)
        self._loop = loop
        self._window: mmap.mmap | None = None
        self._begin = self._end = 0
        self._largest = largest_entry(loop.code.program, loop.code.frames)
        self._reserve = max(WINDOW, 2 * self._largest)
        line = json.dumps({**header, "words": loop.code.frames.words}).encode()
        self._data = -(-(len(MAGIC) + len(line) + 1) // PAGE) * PAGE
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.posix_fallocate(self._file, 0, self._data + PAGE)
                os.pwrite(self._file, (MAGIC + line).ljust(self._data - 1) + b"\n", 0)
                self._first = mmap.mmap(self._file, PAGE, offset=self._data)
                loop.told[control.LOG] = _address(self._first)
                self.grow()
            except OSError:
                if loop.told[control.LOG]:
                    loop.told[control.LOG] = 0  # it is unmapped now, and the loop must not write there
                    self._first.close()
                os.close(self._file)
                self.path.unlink()
                raise
        except OSError as error:
            raise DiagnosticError([self._problem(error)]) from error

    def _problem(self, error: OSError) -> Diagnostic:
        why = "a file is there already" if isinstance(error, FileExistsError) else error.strerror
        message = f"the recording cannot be written: {why}"
        return Diagnostic(
            UNWRITABLE, message, file=str(self.path), hint="name a new file in a folder that can be written"
        )

    def grow(self) -> None:
        """Map the part of the file where the loop goes on. OSError: the disk is full, for example."""
        offset = (self._data + WORD + self.used) // PAGE * PAGE
        os.posix_fallocate(self._file, offset, self._reserve + PAGE)
        window = mmap.mmap(self._file, self._reserve + PAGE, offset=offset)
        self._window, old = window, self._window
        if old is not None:
            old.close()
        self._begin, self._end = offset - self._data, offset - self._data + len(window)
        self.reach()

    def reach(self) -> None:
        """Let the loop append in this process, where the last whole entry ends. OSError: as for `grow`."""
        at = WORD + self.used
        if self._window is None or not self._begin <= at <= self._end - self._largest:
            self.grow()
            return
        told, first = self._loop.told, _address(self._window) - self._begin
        told[control.CURSOR] = told[control.ENTRY] = first + at
        told[control.LIMIT] = first + self._end

    def fileno(self) -> int:
        """The file."""
        return self._file

    @property
    def used(self) -> int:
        """Bytes of whole entries."""
        return int.from_bytes(self._first[:WORD], "little")

    def close(self) -> None:
        """Nothing more is recorded; what was reserved and not used is given back."""
        self._loop.told[control.LOG] = 0
        length = self._data + WORD + self.used
        self._first.flush()
        self._first.close()
        if self._window is not None:
            self._window.close()
        os.ftruncate(self._file, length)
        os.close(self._file)


def _address(mapped: mmap.mmap) -> int:
    return ctypes.addressof(ctypes.c_char.from_buffer(mapped))


def is_recording(path: str | Path) -> bool:
    """Whether a regular file begins as one. OSError: it cannot be read."""
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
        return Path(path).is_file() and file.read(len(KIND)) == KIND


class Recording:
    """A recording that is read: `header`, and iterating over it its turns, up to the last whole one.

    DiagnosticError (E481): it is none, or of another version, or damaged before its first frame.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.damaged = False
        """After iterating: an entry was not one, so what comes after it is not read."""
        try:
            if not self.path.is_file():
                raise OSError(0, "it is not a file")
            self._file = self.path.open("rb")
        except OSError as error:
            raise self._bad(
                f"the recording cannot be read: {error.strerror}", "name a recording of `llfsm run --record`"
            ) from error
        try:
            self._read_header()
        except DiagnosticError:
            self.close()
            raise

    def _read_header(self) -> None:
        first = self._file.readline(len(MAGIC))
        if first != MAGIC:
            if first.startswith(KIND):
                raise self._bad("the recording is of another version", "use the version of llfsm-verify that wrote it")
            raise self._bad("this is not a recording", "name a recording of `llfsm run --record`")
        line = self._file.readline(MOST_HEADER)
        try:
            header = json.loads(line)
            self.words = header["words"]
        except (ValueError, RecursionError, TypeError, KeyError) as error:
            raise self._bad("the recording is damaged: its second line is not a header", "record again") from error
        if not isinstance(self.words, int) or not 1 <= self.words <= MOST_WORDS:
            raise self._bad("the recording is damaged: its frames have no size", "record again")
        self.header: Mapping[str, Json] = MappingProxyType(header)
        used = self._file.read(WORD)
        self._begin = self._file.tell()
        there = max(0, self.path.stat().st_size - self._begin)
        self._used = min(int.from_bytes(used, "little"), there)
        self._is_cut = len(used) < WORD or int.from_bytes(used, "little") > there

    def _bad(self, message: str, hint: str) -> DiagnosticError:
        return DiagnosticError([Diagnostic(UNREADABLE, message, file=str(self.path), hint=hint)])

    @property
    def goes_on(self) -> bool:
        """Whether its first frame is the last one of an earlier recording, from before a machine was loaded."""
        return bool(self.header.get("loaded"))

    def __iter__(self) -> Iterator[Turn]:
        self.damaged = False
        self._file.seek(self._begin)
        left, rest = self._used, b""
        frame = [0] * self.words
        while True:
            chunk = self._file.read(min(left, WINDOW))
            left -= len(chunk)
            data, at = rest + chunk, 0
            while at < len(data):
                try:
                    turn, following = _entry(data, at, frame)
                except IndexError:
                    break
                except ValueError:
                    self.damaged = True
                    return
                at = following
                yield turn
            rest = data[at:]
            if not chunk:
                self.damaged = bool(rest) or self._is_cut
                return

    def close(self) -> None:
        """Nothing more is read."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _entry(data: bytes, at: int, frame: list[int]) -> tuple[Turn, int]:
    """The entry that begins there and where the next one does; `frame` becomes its frame.

    IndexError: it is not whole, and `frame` is as it was. ValueError: it is no entry.
    """
    prescribed: list[Prescription] = []
    while True:
        number, at = _number(data, at)
        if number == 0:
            break
        ringlet, at = _number(data, at)
        value, at = _number(data, at)
        prescribed.append(Prescription(number - 1, ringlet, _unfolded(value)))
    changes: list[tuple[int, int]] = []
    word = -1
    while True:
        gap, at = _number(data, at)
        if gap == 0:
            break
        word += gap
        if word >= len(frame):
            raise ValueError("a word beyond the frame")
        change, at = _number(data, at)
        changes.append((word, _unfolded(change)))
    for word, change in changes:
        new = frame[word] + change & (1 << 64) - 1
        frame[word] = new - (1 << 64) if new >> 63 else new
    return Turn(tuple(prescribed), tuple(frame)), at


def _number(data: bytes, at: int) -> tuple[int, int]:
    number = shift = 0
    while True:
        byte = data[at]
        at += 1
        number |= (byte & 127) << shift
        if byte < 128:
            return number, at
        shift += 7
        if shift > 63:
            raise ValueError("a number of more than 64 bits")


def _unfolded(number: int) -> int:
    return number >> 1 ^ -(number & 1)
