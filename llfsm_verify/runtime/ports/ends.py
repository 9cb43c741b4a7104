"""Where lines come from and go to: descriptors that are there, named pipes that others open and close.

A descriptor that was inherited belongs to others as well, so its flags stay as they are. A write to it is of PIPE_BUF
bytes at most, which a pipe that `poll` calls writable takes without waiting (pipe(7)).
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import Protocol

from llfsm_verify.files import special_kind
from llfsm_verify.runtime.ports.port import Unopened

STANDARD = {"stdin": 0, "stdout": 1, "stderr": 2}
STANDARD_INPUT, STANDARD_OUTPUT = "standard input for reading", "standard output for writing"
"""What ports hold that read the one or write to the other."""
PIPE_HINT = "correct the path, or make a pipe there with `mkfifo`"


class End(Protocol):
    """One end of a stream."""

    retry: float
    """Seconds between two attempts to open it again."""

    def open(self) -> int | None:
        """A descriptor; None: it cannot be opened yet. Unopened: it never can."""

    def renew(self, descriptor: int) -> int | None:
        """The other side is gone: give the descriptor back, for another one if there is one at once."""

    @property
    def returns(self) -> bool:
        """Whether the other side may come back."""

    def close(self) -> None:
        """Give back what is not the descriptor."""


class Inherited:
    """A descriptor of this process."""

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

    def close(self) -> None:
        """See `End`."""


class Named:
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
                self.returns = True  # nobody reads it yet
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
        # The new end is there before the old one goes, so that who opens the pipe meanwhile writes to somebody.
        try:
            return self.open() if self.returns else None
        except Unopened:
            self.returns = False  # it was removed
            return None
        finally:
            os.close(descriptor)

    def close(self) -> None:
        """See `End`."""
