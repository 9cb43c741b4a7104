"""Files that are not named on a command line: read only where that cannot block, and replaced as a whole or not at all.

A name may come from a file of another user (`file:` of an arrangement), or be made here (NAME.trace.yaml in a folder).
So what is there may be a pipe, a device or a link; none of them is waited for, or written through.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from itertools import count
from pathlib import Path
from typing import BinaryIO, Self

UNSAVED: ContextVar[Mapping[str, bytes] | None] = ContextVar("unsaved", default=None)
"""What `read_start` reads in the place of files, by their real paths: what editors have not saved."""

_KINDS = (
    (stat.S_ISDIR, "a directory"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"), (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"), (stat.S_ISLNK, "a link"),
)  # fmt: skip

_NO_LINKS = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)
"""What a file system says that has no links, or no more of them."""


def special_kind(mode: int) -> str | None:
    """What a file is that is not a regular one, by its mode."""
    return next((name for is_kind, name in _KINDS if is_kind(mode)), None)


def read_regular(path: str | Path, most: int) -> bytes:
    """The content of a regular file, at most `most` bytes of it. OSError: nothing is there, or something else is.

    A file to which the system gives no size is empty here: reading those of /proc may block, or take from others what
    is read.
    """
    # A device is not opened at all, since that alone can do something; what takes its place meanwhile does not block.
    refuse_special(Path(path).stat())
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY), "rb") as file:
        status = os.fstat(file.fileno())
        refuse_special(status)
        return file.read(min(status.st_size, most))


def read_start(path: str | Path, most: int, *, regular: bool = False) -> bytes:
    """At most `most` bytes of a file; `regular`: see `read_regular`. Raises OSError."""
    unsaved = UNSAVED.get()
    if unsaved is not None and (given := unsaved.get(os.path.realpath(path))) is not None:
        return given[:most]
    if regular:
        return read_regular(path, most)
    with open(path, "rb") as file:
        return file.read(most)


def refuse_special(status: os.stat_result) -> None:
    """OSError: it is no regular file."""
    kind = special_kind(status.st_mode)
    if kind is not None:
        refused = IsADirectoryError if kind == "a directory" else OSError
        raise refused(errno.EINVAL, f"it is {kind}, and a file is expected")


@contextmanager
def unfinished(path: Path) -> Iterator[tuple[BinaryIO, Path]]:
    """A new file with a name of its own beside `path`, to be renamed; in the end that name is gone. Raises OSError.

    Only `kill -9` leaves such a file behind, and no later one is in its way: `.NAME.PID`, `.NAME.PID-2` and so on.
    """
    file, name = _create(path)
    try:
        with file:
            yield file, name
    finally:
        name.unlink(missing_ok=True)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file that takes the place of the one at `path`, and its permissions, when all is written. Raises OSError."""
    with unfinished(path) as (file, name):
        with suppress(OSError):  # nothing is replaced, or the file system knows no permissions
            os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode))
        yield file
        file.close()  # what is still in memory is written, or found not to fit
        try:
            name.replace(path)
        except OSError as error:
            raise type(error)(
                error.errno, error.strerror, str(path)
            ) from None  # the user does not know the temporary name


def _create(path: Path) -> tuple[BinaryIO, Path]:
    for number in count(1):
        name = path.with_name(f".{path.name}.{os.getpid()}{f'-{number}' if number > 1 else ''}")
        try:
            return name.open("xb"), name
        except FileExistsError:
            continue  # left by a process that was killed, and had our number
        except OSError as error:
            error.filename = str(path)  # the user does not know the other name
            raise
    raise AssertionError("names do not end")


def publish(name: Path, path: Path) -> bool:
    """Give a file that is now whole its name, `path`; False: something has that name already. Raises OSError.

    On a file system without links, `kill -9` can leave an empty file of that name.
    """
    try:
        # A link, unlike a renaming, never takes the place of a file that another process has made meanwhile.
        os.link(name, path)
    except FileExistsError:
        return False
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        # An empty file keeps the name until the whole one takes its place.
        try:
            path.open("xb").close()
        except FileExistsError:
            return False
        try:
            name.replace(path)
        except BaseException:
            path.unlink()
            raise
    return True


class Closing:
    """Is closed at the end of a `with`."""

    def close(self) -> None:
        """Give back what is held."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
