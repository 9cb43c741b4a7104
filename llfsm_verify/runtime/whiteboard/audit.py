"""An audit log: who asked what of a run, and what came of it, as lines of JSON that are chained by hashes.

Each line has the SHA-256 (hex) of the line before it under `after`, so no line can be changed, left out or put between
two others without changing all that come after it. Whoever can write the file can write all of it anew, and
missing lines at the end leave no sign: what must not be lost is the hash of the last line, which the run prints in the
end and `llfsm audit verify LOG --last HASH` compares. That line has the hashes of the recordings, so it seals them.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import stat
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import BinaryIO

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.jsonvalue import Json

CODES = {
    "E500": "An audit log cannot be read or written there.",
    "E501": "An audit log was changed: a line is not the one that was written there.",
}
UNUSABLE, CHANGED = "E500", "E501"
NOTHING = "0" * 64
"""What comes before the first line."""
MOST_LINE = 1 << 20
BEGUN, ENDED = "begun", "ended"


@dataclass(frozen=True, slots=True)
class Verified:
    """A log whose lines are all those that were written, up to its last one."""

    entries: int
    last: str
    """The hash of the last line."""
    open: bool
    """The last run in it has no end: it goes on, was killed, or lines at the end are missing."""


class AuditLog:
    """Appends to a log, which it begins if it is not there. Only one run at a time writes it.

    DiagnosticError (E500, E501): it cannot be written, or it is not whole, so nothing is appended to it.
    """

    def __init__(self, path: str | Path, clock: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self.path = Path(path)
        self._clock = clock
        self.failure: str | None = None
        """Why nothing can be written any more."""
        try:
            flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
            self._file = os.open(self.path, flags, 0o640)
        except OSError as error:
            raise _unusable(self.path, error.strerror or "it cannot be opened") from None
        try:
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise _unusable(self.path, "it is not a regular file")
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise _unusable(self.path, "another run writes it") from None
            with open(os.dup(self._file), "rb") as file:
                file.seek(0)
                self.last = _read(file, self.path).last
            self._length = os.fstat(self._file).st_size
        except BaseException:
            os.close(self._file)
            raise

    def begin(self, facts: Mapping[str, Json]) -> None:
        """Append the line of a run that begins. DiagnosticError (E500): it cannot be written, so the run must not
        begin; a log that was empty is removed then."""
        self.note(BEGUN, facts)
        if self.failure is not None:
            if not self._length:
                self.path.unlink(missing_ok=True)
            raise _unusable(self.path, self.failure)

    def note(self, what: str, facts: Mapping[str, Json]) -> None:
        """Append a line; where that fails, `failure` says why."""
        entry = {"what": what, "time": self._clock().isoformat(timespec="microseconds"), **facts, "after": self.last}
        line = json.dumps(entry, ensure_ascii=True).encode() + b"\n"
        if self.failure is not None:
            return
        status = os.fstat(self._file)
        try:
            if not status.st_nlink or status.st_size != self._length:
                raise OSError(0, "somebody else has changed or removed it")
            if len(line) >= MOST_LINE:
                raise OSError(0, "an entry is too long")
            if os.write(self._file, line) < len(line):
                raise OSError(0, "no space left on device")
            os.fdatasync(self._file)
        except OSError as error:
            self.failure = error.strerror or "it cannot be written"
            if os.fstat(self._file).st_size > status.st_size:
                with suppress(OSError):
                    os.ftruncate(self._file, status.st_size)  # no part of a line stays: it would look like a forgery
            return
        self.last = _hash(line)
        self._length += len(line)

    @property
    def room(self) -> int:
        """Bytes that are free on its disk."""
        disk = os.fstatvfs(self._file)
        return disk.f_bavail * disk.f_frsize

    def close(self) -> None:
        """Write no more."""
        os.close(self._file)


def verify(path: str | Path) -> Verified:
    """Whether each line is the one that was written. DiagnosticError (E500, E501)."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        with open(descriptor, "rb") as file:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise _unusable(path, "it is not a regular file")
            found = _read(file, path)
    except OSError as error:
        raise _unusable(path, error.strerror or "it cannot be read") from None
    if not found.entries:
        raise _changed(path, 1, "there is none, and a run writes one when it begins")
    return found


def _read(file: BinaryIO, path: str | Path) -> Verified:
    last, number, is_open = NOTHING, 0, False
    for number, line in enumerate(iter(partial(file.readline, MOST_LINE), b""), 1):
        try:
            entry = json.loads(line)
            before, what = entry["after"], entry["what"]
        except (ValueError, RecursionError, TypeError, KeyError):
            raise _changed(path, number, "it is not an entry of a log") from None
        if before != last:
            between = f"line {number - 1:,} was changed, or lines between them are missing"
            raise _changed(path, number, between if number > 1 else "lines before it are missing")
        if not line.endswith(b"\n"):
            raise _changed(path, number, "it has no end")
        last, is_open = _hash(line), what != ENDED
    return Verified(number, last, is_open)


def seal_of(path: str | Path) -> str:
    """The SHA-256 of a file that a run has written, as hexadecimal digits, or why it has no hash."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        return error.strerror or "it cannot be read"


def _hash(line: bytes) -> str:
    return hashlib.sha256(line).hexdigest()


def _unusable(path: str | Path, why: str) -> DiagnosticError:
    hint = "name a file of your own, as a new one or one that `--audit` wrote"
    return DiagnosticError([Diagnostic(UNUSABLE, f"the audit log cannot be used: {why}", file=str(path), hint=hint)])


def _changed(path: str | Path, number: int, why: str) -> DiagnosticError:
    message = f"line {number:,} of the audit log is not the one that was written there: {why}"
    hint = "the lines before it are as they were; keep the file as evidence, and let runs write a new one"
    return DiagnosticError([Diagnostic(CHANGED, message, file=str(path), hint=hint)])


FIRST, INTERVAL = 32, 60.0
"""So many entries of a user are written one by one in so many seconds; while there are more, only their number is."""


class _Counted:
    def __init__(self, until: float, *, listed: bool) -> None:
        self.until = until
        self.listed = listed
        """Entries of this interval are written, the first ones."""
        self.all = self.left_out = 0


class Sparing:
    """Counts entries by what they say and by the user that causes them."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._counted: dict[tuple[str, str], _Counted] = {}

    def writes(self, what: str, user: str, *, room: bool) -> bool:
        """Whether one more entry is written, where there is room for it; else it is counted."""
        counted = self._counted.setdefault((what, user), _Counted(self._clock() + INTERVAL, listed=True))
        counted.all += 1
        written = room and counted.listed and counted.all <= FIRST
        counted.left_out += not written
        return written

    def left_out(self, *, over: bool = False) -> Iterator[tuple[str, str, int]]:
        """What was counted in the intervals that have ended, all if the run is `over`: what, by whom, how often."""
        now = self._clock()
        for key, counted in [*self._counted.items()]:
            if now >= counted.until or over:
                del self._counted[key]
                if counted.left_out:
                    yield (*key, counted.left_out)
                if counted.all > FIRST:
                    self._counted[key] = _Counted(now + INTERVAL, listed=False)
