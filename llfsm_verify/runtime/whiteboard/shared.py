"""What a run shares with its readers and with those who post: made before its processes are forked."""

from __future__ import annotations

import ctypes
import os
import re
import socket
import struct
from contextlib import ExitStack, closing, suppress
from pathlib import Path

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.control import words
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.whiteboard.posts import Posts
from llfsm_verify.runtime.whiteboard.segment import Segment

ROW_WORDS = 16
MOST = 1024
SUFFIX = ".wake"
SENT = 1 << 22
"""Bytes that may wait in the sockets of all subscribers: many that do not read shall not keep others asleep."""


def wake_path(board: Path, number: int) -> Path:
    """The socket of a subscriber to the whiteboard with this socket."""
    return board.with_name(f"{board.stem}.{number}{SUFFIX}")


def remove_old(board: Path) -> None:
    """Remove the sockets that a server of this whiteboard who was killed has left."""
    old = re.compile(re.escape(board.stem) + r"\.[0-9]+" + re.escape(SUFFIX))
    for path in board.parent.iterdir():
        if old.fullmatch(path.name):
            path.unlink(missing_ok=True)


class Wakes:
    """The subscribers of a loop, which sends each a datagram after a frame. Make it before processes of the run are
    forked.

    The address of a subscriber's socket is in a row of 16 words: its length in bytes, or 0, and then the address
    (`struct sockaddr_un`). Sending never waits; a subscriber whose socket is full is awake already. The server binds
    these sockets itself, beside its own, and hands them out: no address comes from a client, and the server removes
    only what it has made.
    """

    def __init__(self, loop: Loop) -> None:
        self._rows = words(MOST * ROW_WORDS)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SENT)
        self._loop = loop
        loop.control[control.WAKES] = ctypes.addressof(self._rows)
        loop.control[control.WAKE_SOCKET] = self._socket.fileno()

    def fileno(self) -> int:
        """The socket that wakes them."""
        return self._socket.fileno()

    def add(self, board: Path) -> tuple[int, socket.socket]:
        """A number for a new subscriber to this whiteboard, and the socket at which it is woken.

        ValueError: there are too many; OSError: there is no socket.
        """
        number = next((n for n in range(MOST) if not self._rows[n * ROW_WORDS]), None)
        if number is None:
            raise ValueError(f"there are {MOST} subscribers already")
        path = wake_path(board, number)
        woken = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            os.fchmod(woken.fileno(), 0o600)  # before it has a name
            path.unlink(missing_ok=True)
            woken.bind(str(path))
        except OSError:
            woken.close()
            raise
        address = struct.pack("=H", socket.AF_UNIX) + os.fsencode(path) + b"\0"
        ctypes.memmove(ctypes.addressof(self._rows) + 8 * (number * ROW_WORDS + 1), address, len(address))
        self._rows[number * ROW_WORDS] = len(address)
        self._loop.control[control.WAKE_COUNT] = max(self._loop.control[control.WAKE_COUNT], number + 1)
        return number, woken

    def remove(self, board: Path, number: int) -> None:
        """It wants no more."""
        self._rows[number * ROW_WORDS] = 0
        with suppress(OSError):
            wake_path(board, number).unlink(missing_ok=True)

    def close(self) -> None:
        """No one is woken any more; the loop must not run."""
        self._loop.control[control.WAKE_COUNT] = 0
        self._socket.close()


class Shared:
    """The segment of a run's frames, the posts for its inputs, and whom each frame wakes.

    `served`: other processes may read and post, so that memory for their posts is made. OSError: there are not enough
    descriptors for it.
    """

    def __init__(self, name: str, loop: Loop, *, served: bool = True) -> None:
        self.name = name
        self.loop = loop
        self.served = served
        with ExitStack() as made:
            self.segment = made.enter_context(
                closing(Segment(name, loop.code.frames.words, loop.control[control.PERIOD]))
            )
            self.posts = made.enter_context(closing(Posts(loop, lends=served)))
            self.wakes = Wakes(loop)
            made.pop_all()
        self.descriptors = (self.wakes.fileno(),)
        """What a process needs that runs the loop."""
        loop.control[control.SEGMENT] = self.segment.address

    def close(self) -> None:
        """Readers keep what they have; the loop must not run."""
        self.loop.control[control.SEGMENT] = 0
        self.wakes.close()
        self.posts.close()
        self.segment.close()
