"""The file of a recording: what was run, and how each frame differs from the one before.

    llfsm-verify recording 2
    {"name": …}            one line of JSON, filled up with spaces so that the next part begins a page
    used                   8 bytes, little endian: how many bytes of entries are whole turns
    closed                 4 bytes: 0: a process writes it, or was killed; `WHOLE`: it has its last frame; another
                           number: the file could not grow (`Recorder._closed`)
    checksum               4 bytes: CRC-32 of all that comes before `used`
    entry entry …          one for each frame

An entry is a sequence of numbers, seven bits a byte, the lowest first, the highest bit set on all bytes but the last;
one with a sign is folded (0, -1, 1, -2, … are 0, 1, 2, 3, …). First come the choices that were prescribed within the
turn: 1 + the number of the choice, the ringlet of the turn (the second one is 1), and the value with its sign; then 0.
Then come the words of the frame that differ from the frame before: how many words further on, and the difference with
its sign, modulo 2^64; then 0. The frame before the first one is all zeros. The last four bytes of an entry are a
checksum of the entry and of the checksum before it, so a chain leads from the header to the last frame (`checksum`).
Format 1 had neither `closed` nor checksums. `used` and `closed` have none: with less in `used`, 0 in `closed` and zeros
at the end, a run that has ended looks like one that was killed. The audit log tells: `ended` has the SHA-256 of the
file.

The loop appends entries to a mapped part of the file and publishes `used` last: a process that is killed loses the turn
it was in. A file system that is full is noticed when the next part is reserved, before anything is written to it.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import json
import mmap
import os
import re
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import Closing
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import ENDING, HEADER_WORDS
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.text import CHECK_BYTES, MULTIPLIER, largest_entry
from llfsm_verify.runtime.recording import UNREADABLE, UNWRITABLE

KIND = b"llfsm-verify recording "
MAGIC, WITHOUT_CHECKSUMS = KIND + b"2\n", KIND + b"1\n"
PAGE = mmap.ALLOCATIONGRANULARITY
WINDOW = 1 << 20
"""Bytes that are mapped and reserved at a time, at least."""
WORD = 8
HEAD = WORD + 4 + CHECK_BYTES
"""Bytes before the first entry: `used`, `closed` and the first checksum."""
OPEN, WHOLE = 0, 1
KILLED, GOES_ON = "the process was killed", "the run goes on"
MOST_HEADER = 1 << 26
WORD_OF_BUILD = re.compile("[a-z0-9]{1,30}")
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
        head = (MAGIC + line).ljust(self._data - 1) + b"\n"
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.posix_fallocate(self._file, 0, self._data + PAGE)
                os.pwrite(self._file, head, 0)
                self._first = mmap.mmap(self._file, PAGE, offset=self._data)
                self._first[HEAD - CHECK_BYTES : HEAD] = zlib.crc32(head).to_bytes(CHECK_BYTES, "little")
                loop.control[control.LOG] = _address(self._first)
                self.grow()
            except OSError:
                if loop.control[control.LOG]:
                    loop.control[control.LOG] = 0  # it is unmapped now, and the loop must not write there
                    self._first.close()
                os.close(self._file)
                self.path.unlink()
                raise
        except OSError as error:
            raise DiagnosticError([self.problem(error)]) from error

    def problem(self, error: OSError) -> Diagnostic:
        """What users read of it (E480)."""
        why = "a file is there already" if isinstance(error, FileExistsError) else error.strerror
        message = f"the recording cannot be written: {why}"
        return Diagnostic(
            UNWRITABLE, message, file=str(self.path), hint="name a new file in a folder that can be written"
        )

    def grow(self) -> None:
        """Map the part of the file where the loop goes on. OSError: the disk is full, for example."""
        offset = (self._data + HEAD + self.used - CHECK_BYTES) // PAGE * PAGE
        os.posix_fallocate(self._file, offset, self._reserve + PAGE)
        window = mmap.mmap(self._file, self._reserve + PAGE, offset=offset)
        self._window, old = window, self._window
        if old is not None:
            old.close()
        self._begin, self._end = offset - self._data, offset - self._data + len(window)
        self.reach()

    def reach(self) -> None:
        """Let the loop append in this process, where the last whole entry ends. OSError: as for `grow`."""
        at = HEAD + self.used
        if self._window is None or not self._begin <= at - CHECK_BYTES <= at <= self._end - self._largest:
            self.grow()
            return
        block, first = self._loop.control, _address(self._window) - self._begin
        block[control.CURSOR] = block[control.ENTRY] = first + at
        block[control.LIMIT] = first + self._end

    def fileno(self) -> int:
        """The file."""
        return self._file

    @property
    def used(self) -> int:
        """Bytes of whole entries."""
        return int.from_bytes(self._first[:WORD], "little")

    @property
    def _closed(self) -> int:
        """Why nothing more is written; each value has its complement beside it, so that no damage looks like one."""
        return int.from_bytes(self._first[WORD : WORD + 2], "little")

    def _close(self, why: int) -> None:
        self._loop.control[control.LOG] = OPEN
        if self._closed == OPEN and why != OPEN:
            self._first[WORD : WORD + 4] = (why | (why ^ 0xFFFF) << 16).to_bytes(4, "little")

    def give_up(self, error: OSError) -> str:
        """Nothing more is recorded, since the file cannot grow; the file and the result say why. No byte of the file
        system is needed for it."""
        number = error.errno if error.errno and 0 < error.errno < 1 << 15 else errno.EIO
        self._close(WHOLE + number)
        return os.strerror(number)

    def close(self) -> None:
        """Nothing more is recorded; what was reserved and not used is given back, if the recording has its end."""
        self._close(WHOLE if self._loop.frame[ENDING] else OPEN)
        closed, length = self._closed, self._data + HEAD + self.used
        self._first.flush()
        self._first.close()
        if self._window is not None:
            self._window.close()
        if closed != OPEN:
            os.ftruncate(self._file, length)
        os.close(self._file)


def _address(mapped: mmap.mmap) -> int:
    return ctypes.addressof(ctypes.c_char.from_buffer(mapped))


def is_recording(path: str | Path) -> bool:
    """Whether a regular file begins as one; a file that cannot be read does not."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            return Path(path).is_file() and file.read(len(KIND)) == KIND
    except (OSError, ValueError):
        return False  # what is wrong with it is said where files of other kinds are read


class Recording(Closing):
    """A recording that is read: `header`, and iterating over it its turns, up to the last whole one.

    DiagnosticError (E481): the file is not one, or is damaged before its first frame.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.damaged: str | None = None
        """After iterating: what is wrong with what comes after the last turn, which is not read."""
        self.lost: str | None = None
        """After iterating: why the last frame of the run is not there."""
        try:
            if not self.path.is_file():
                raise OSError(0, "it is not a file")
            self._file = self.path.open("rb")
        except OSError as error:
            raise self._bad(
                f"the recording cannot be read: {error.strerror}",
                "name a recording of `llfsm run --record`, or give a log its `--mapping`",
            ) from error
        try:
            self._read_header()
        except DiagnosticError:
            self.close()
            raise

    def _read_header(self) -> None:
        self._is_written = self._is_locked()  # before anything is read: it may end meanwhile
        first = self._file.readline(len(MAGIC))
        if first not in (MAGIC, WITHOUT_CHECKSUMS):
            if first.startswith(KIND):
                raise self._bad("the recording is of another version", "use the version of llfsm-verify that wrote it")
            raise self._bad(
                "this is not a recording", "name a recording of `llfsm run --record`, or give a log its `--mapping`"
            )
        line = self._file.readline(MOST_HEADER)
        try:
            header = json.loads(line)
            self.words = header["words"]
        except (ValueError, RecursionError, TypeError, KeyError) as error:
            raise self._bad("the recording is damaged: its second line is not a header", "record again") from error
        if not isinstance(self.words, int) or not HEADER_WORDS <= self.words <= MOST_WORDS:
            raise self._bad("the recording is damaged: its frames have no size", "record again")
        self.header: Mapping[str, Json] = MappingProxyType(header)
        self.goes_on = bool(self.header.get("loaded"))
        """Whether its first frame is the last one of an earlier recording, from before a machine was loaded."""
        self.has_checksums = first == MAGIC
        size = HEAD if self.has_checksums else WORD
        head = self._file.read(size)
        if len(head) < size:
            raise self._bad("the recording is damaged: its end is missing", "record again")
        self._begin = self._file.tell()
        self._there = max(0, self.path.stat().st_size - self._begin)
        self._used = int.from_bytes(head[:WORD], "little")
        self._closed = int.from_bytes(head[WORD : WORD + 4], "little")
        self._first = int.from_bytes(head[HEAD - CHECK_BYTES :], "little") if self.has_checksums else None
        if self.has_checksums and self._first != zlib.crc32(first + line):
            raise self._bad("the recording is damaged: its header was changed", "record again")

    def _is_locked(self) -> bool:
        """Whether a process writes the recording now."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False  # a file system without locks
        fcntl.flock(self._file, fcntl.LOCK_UN)
        return False

    def _bad(self, message: str, hint: str) -> DiagnosticError:
        return DiagnosticError([Diagnostic(UNREADABLE, message, file=str(self.path), hint=hint)])

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be said before anything else."""
        old = "the recording is of format 1, which has no checksums: nothing tells whether a time in it was edited"
        found = () if self.has_checksums else (old,)
        if self.header.get("clock") == "external":
            found = *found, "its clock was external: a port began each cycle"
        build = self.header.get("build")
        words = [build.get(key) for key in ("target", "for", "layout")] if isinstance(build, Mapping) else []
        if not words or not all(isinstance(word, str) and WORD_OF_BUILD.fullmatch(word) for word in words):
            return found
        return *found, "a program of `llfsm build --target {} --for {}` wrote it, with layout {}".format(*words)

    def __iter__(self) -> Iterator[Turn]:
        self.damaged = self.lost = None
        left, check, rest, last = min(self._used, self._there), self._first, b"", None
        frame = [0] * self.words
        self._file.seek(self._begin)
        while True:
            chunk = self._file.read(min(left, WINDOW))
            left -= len(chunk)
            data, at = rest + chunk, 0
            while at < len(data):
                try:
                    last, check, at = _entry(data, at, frame, check)
                except IndexError:
                    break
                except ValueError as error:
                    self.damaged = str(error)
                    return
                yield last
            rest = data[at:]
            if not chunk:
                break
        if rest or self._used > self._there:
            self.damaged = "the end of the file is missing"
        elif last is None or not last.frame[ENDING]:
            self._say_why_it_ends(frame, check)
        elif self.has_checksums and not self._is_written and self._closed != OPEN:
            # Zeros after the last frame may have been reserved.
            if any(any(data) for data in iter(lambda: self._file.read(WINDOW), b"")):
                self.damaged = "something was appended to it"

    def _say_why_it_ends(self, frame: list[int], check: int | None) -> None:
        """Without a last frame. A file that was not closed still has what was reserved for it, in whole pages, and a
        process that was killed can have written one entry more at most than it has counted."""
        why, reserved = self._closed & 0xFFFF, not (self._begin + self._there) % PAGE
        if check is None or (self._is_written and why in (OPEN, WHOLE)):
            self.lost = GOES_ON if self._is_written else KILLED
            return
        is_named = self._closed in (OPEN, why | (why ^ 0xFFFF) << 16)
        if not is_named or why == WHOLE or not (reserved or (why and self._there == self._used)):
            self.damaged = "frames at its end are missing"
            return
        if why == OPEN:
            data, at = self._file.read(WINDOW), 0
            with suppress(IndexError, ValueError):
                for _ in range(2):
                    _, check, at = _entry(data, at, frame, check)
                self.damaged = "frames at its end are missing"
                return
        self.lost = KILLED if why == OPEN else f"the file could not grow ({os.strerror(why - WHOLE)})"

    def close(self) -> None:
        """Nothing more is read."""
        self._file.close()


def checksum(entry: bytes, before: int) -> int:
    """Of an entry after one with the checksum `before`, as `@checksum` of `runtime.live.text` computes it."""
    state = len(entry) << 32 | before
    for at in range(0, len(entry), WORD):
        state = (state ^ int.from_bytes(entry[at : at + WORD], "little")) * MULTIPLIER & (1 << 64) - 1
        state ^= state >> 32
    return state & (1 << 32) - 1


def _entry(data: bytes, begin: int, frame: list[int], before: int | None) -> tuple[Turn, int | None, int]:
    """The entry that begins there, its checksum (None: it has no checksum), and where the next one begins; `frame`
    becomes its frame.

    IndexError: it is not whole, and `frame` is as it was. ValueError: it is no entry.
    """
    at = begin
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
            raise ValueError("what follows cannot be a frame")
        change, at = _number(data, at)
        changes.append((word, _unfolded(change)))
    check = None
    if before is not None:
        body, at = data[begin:at], at + CHECK_BYTES
        if at > len(data):
            raise IndexError("its checksum is not there")
        check = checksum(body, before)
        if check != int.from_bytes(data[at - CHECK_BYTES : at], "little"):
            raise ValueError("the next frame is not the one that was recorded, by its checksum")
    for word, change in changes:
        new = frame[word] + change & (1 << 64) - 1
        frame[word] = new - (1 << 64) if new >> 63 else new
    return Turn(tuple(prescribed), tuple(frame)), check, at


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
            raise ValueError("what follows cannot be a frame")


def _unfolded(number: int) -> int:
    return number >> 1 ^ -(number & 1)
