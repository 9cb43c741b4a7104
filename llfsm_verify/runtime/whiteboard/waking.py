"""Those who want to be woken by each frame: the addresses of their sockets, which the loop sends a datagram to.

Each address is in a row of 16 words: its length in bytes, or 0, and then the address (`struct sockaddr_un`). Sending
never waits; a subscriber whose socket is full is awake already.
"""

from __future__ import annotations

import ctypes
import re
import socket
import struct
from pathlib import Path

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.memory import words

ROW_WORDS = 16
MOST = 64
NAME = re.compile(r"[0-9a-f]{16}\Z")
"""What a subscriber calls its socket, in the folder of whiteboards."""
SUFFIX = ".wake"
LONGEST = 107
"""Bytes of a path in an address."""


class Wakes:
    """The subscribers of a loop. Make it before processes of the run are forked."""

    def __init__(self, loop: Loop) -> None:
        self._rows = words(MOST * ROW_WORDS)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._loop = loop
        loop.told[control.WAKES] = ctypes.addressof(self._rows)
        loop.told[control.WAKE_SOCKET] = self._socket.fileno()

    def fileno(self) -> int:
        """The socket that wakes them."""
        return self._socket.fileno()

    def add(self, path: Path) -> int:
        """A number for a new subscriber. ValueError: there are too many, or its path is too long."""
        address = struct.pack("=H", socket.AF_UNIX) + str(path).encode() + b"\0"
        if len(address) > LONGEST + 3:
            raise ValueError(f"the path of its socket is longer than {LONGEST} bytes")
        number = next((n for n in range(MOST) if not self._rows[n * ROW_WORDS]), None)
        if number is None:
            raise ValueError(f"there are {MOST} subscribers already")
        ctypes.memmove(ctypes.addressof(self._rows) + 8 * (number * ROW_WORDS + 1), address, len(address))
        self._rows[number * ROW_WORDS] = len(address)
        self._loop.told[control.WAKE_COUNT] = max(self._loop.told[control.WAKE_COUNT], number + 1)
        return number

    def remove(self, number: int) -> None:
        """It wants no more."""
        self._rows[number * ROW_WORDS] = 0

    def close(self) -> None:
        """Nobody is woken any more; the loop must not run."""
        self._loop.told[control.WAKE_COUNT] = 0
        self._socket.close()
