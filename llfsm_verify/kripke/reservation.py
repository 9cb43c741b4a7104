"""The place of a checkpoint file, kept for one search: nothing else is replaced there, and nobody else saves there.

The file itself is locked, not another one beside it; it is empty until something is saved. A new checkpoint is written
under one other name, FILE.tmp, and locked before it takes the place of the old one: so at every moment the file of that
name is whole, and locked. What `kill -9` leaves behind is an empty file or FILE.tmp, and the next search uses both up.
"""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock

from llfsm_verify.files import special_kind
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.checkpoint import FORMAT, KIND, write
from llfsm_verify.kripke.memory import Region

ENDING = ".tmp"
_OPEN = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK
_MODE = 0o600
_TRIES = 100


class NotReplaceable(Exception):
    """Something is there that is not a checkpoint, and stays; the message says what."""


class Taken(Exception):
    """Another search is saving there."""


class Reservation:
    """A place that is this search's until `release`, which also happens when this process ends.

    A second reservation in the same process takes the place over from the first.
    """

    def __init__(self, path: Path) -> None:
        """Raises NotReplaceable, Taken, and OSError when files cannot be made there."""
        self._path = Path(os.path.realpath(path))  # a link is kept, and what it leads to replaced
        self._new = self._path.with_name(self._path.name + ENDING)
        _must_be_replaceable(self._path)
        with _GUARD:
            before = _HELD.get(self._path)
            if before is not None:
                before.release()
            self._file: int | None = _locked(self._path)
            _HELD[self._path] = self
        try:
            _must_be_replaceable(self._path)  # again, now that nobody changes it
            _must_be_replaceable(self._new, in_part=True)
            self._new.unlink(missing_ok=True)
            os.close(os.open(self._new, _OPEN | os.O_EXCL, _MODE))  # can it be made?
            self._new.unlink()
        except BaseException:
            self.release()
            raise

    def save(self, header: Mapping[str, Json], sections: Sequence[tuple[Region, int]]) -> None:
        """Replace the file when a new one is whole and on the disk. Raises OSError; then the old one is still there."""
        if self._file is None:
            raise OSError(errno.EBUSY, "another search is saving there")
        new = os.open(self._new, _OPEN | os.O_TRUNC | os.O_NOFOLLOW, _MODE)
        try:
            fcntl.flock(new, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with open(new, "wb", closefd=False) as file:
                write(file, header, sections)
            os.fsync(new)
            if not _is_at(self._file, self._path) and self._path.exists():
                raise OSError(errno.EEXIST, "another file has been put in its place")
            self._new.replace(self._path)
        except BaseException:
            os.close(new)
            self._new.unlink(missing_ok=True)
            raise
        os.close(self._file)
        self._file = new
        _sync(self._path.parent)

    def release(self) -> None:
        """Give the place up. Where nothing was saved, no file is left."""
        if self._file is None:
            return
        file, self._file = self._file, None
        _HELD.pop(self._path, None)
        try:
            if os.fstat(file).st_size == 0 and _is_at(file, self._path):
                self._path.unlink()
        except OSError:
            pass  # an empty file is no harm
        finally:
            os.close(file)


_HELD: dict[Path, Reservation] = {}
"""The reservations of this process. Locks tell processes apart only."""
_GUARD = Lock()


def _locked(path: Path) -> int:
    """The file, made if need be, and locked. Raises Taken."""
    for _ in range(_TRIES):
        file = os.open(path, _OPEN, _MODE)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(file)
            raise Taken from None
        except OSError:
            os.close(file)
            raise
        if _is_at(file, path):
            return file
        os.close(file)  # it was replaced or removed in between
    raise Taken


def _is_at(file: int, path: Path) -> bool:
    """Whether an open file is the one of this name."""
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _must_be_replaceable(path: Path, *, in_part: bool = False) -> None:
    """Raises NotReplaceable unless there is nothing, an empty file or a checkpoint, `in_part` also one cut short."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    kind = special_kind(mode)
    if kind is not None:
        raise NotReplaceable(f"{path} is {kind}")
    with path.open("rb") as file:
        first = file.read(len(FORMAT))
    if first and not first.startswith(KIND) and not (in_part and KIND.startswith(first)):
        raise NotReplaceable(f"{path} is not a checkpoint")


def _sync(folder: Path) -> None:
    """Have the names in a folder written to the disk. Raises OSError."""
    file = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(file)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot, and need not
            raise
    finally:
        os.close(file)
