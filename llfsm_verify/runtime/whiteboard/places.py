"""Where whiteboards are found: a Unix socket for each, by name, in a folder that its owner alone may write."""

from __future__ import annotations

import os
import re
import socket
import stat
import struct
from pathlib import Path

NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}\Z")
SUFFIX = ".whiteboard"
LONGEST = 107
"""Bytes of the path of a socket."""
MOST_REQUEST = 1 << 20
"""Bytes of a request to a server, which may have the text of a machine."""

_CREDENTIALS = struct.Struct("3i")
"""What the system says of who is at the other end: process, user, group."""
NOBODY = -1
"""The user where there is no other end."""


def peer_of(connection: socket.socket) -> tuple[int, int]:
    """The numbers of the process and the user at the other end of a connection, as the system knows them. OSError."""
    pid, uid, _ = _CREDENTIALS.unpack(connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size))
    return pid, uid


class NoPlace(Exception):
    """There is no folder for whiteboards that can be trusted, or a whiteboard has no such name."""


def folder(*, own: bool = False) -> tuple[Path, int]:
    """The folder of whiteboards, which is made if it is missing, and the user to whom it belongs.

    ``LLFSM_WHITEBOARDS``, else a folder in ``XDG_RUNTIME_DIR``, else one in /tmp. The first may belong to another user,
    for readers; not with `own`. NoPlace: it belongs to another user, or others may write there.
    """
    named = os.environ.get("LLFSM_WHITEBOARDS")
    home = os.environ.get("XDG_RUNTIME_DIR")
    path = Path(named) if named else Path(home) / "llfsm" if home else Path(f"/tmp/llfsm-{os.getuid()}")  # noqa: S108
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
    except OSError as error:
        raise NoPlace(f"the folder {path} cannot be made: {error.strerror}") from None
    if not stat.S_ISDIR(status.st_mode) or status.st_mode & 0o022:
        raise NoPlace(f"{path} is not a folder that its owner alone may write; LLFSM_WHITEBOARDS names another one")
    if status.st_uid != os.getuid() and (own or not named):
        raise NoPlace(f"{path} is not a folder of yours; LLFSM_WHITEBOARDS names another one")
    return path, status.st_uid


def socket_path(name: str, *, own: bool = False) -> Path:
    """The socket of the whiteboard of that name. NoPlace: see `location`."""
    return location(name, own=own)[0]


def location(name: str, *, own: bool = False) -> tuple[Path, int]:
    """The socket of the whiteboard of that name, and the user to whom its folder belongs.

    NoPlace: it is no name, its path is too long, or see `folder`.
    """
    if not NAME.match(name):
        raise NoPlace(
            f"`{name[:64]}` is not a valid name of a whiteboard: letters, digits, `_`, `.` and `-`, at most 64"
        )
    parent, user = folder(own=own)
    path = parent / (name + SUFFIX)
    if (length := len(os.fsencode(path))) > LONGEST:
        raise NoPlace(
            f"the path of its socket would be {length} bytes long, and {LONGEST} are the most; LLFSM_WHITEBOARDS names "
            "another folder"
        )
    return path, user


def names() -> list[str]:
    """The whiteboards whose sockets are there, also those whose servers have died. NoPlace: see `folder`."""
    parent, _ = folder()
    try:
        return sorted(path.name.removesuffix(SUFFIX) for path in parent.iterdir() if path.name.endswith(SUFFIX))
    except OSError as error:
        raise NoPlace(f"the folder {parent} cannot be read: {error.strerror}") from None
