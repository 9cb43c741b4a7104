"""Where whiteboards are found: a Unix socket for each, by name, in a folder that belongs to its user alone."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}\Z")
SUFFIX = ".whiteboard"
MOST_REQUEST = 1 << 20
"""Bytes of a request to an owner, which may have the text of a machine."""


class NoPlace(Exception):
    """There is no folder for whiteboards that can be trusted, or a whiteboard has no such name."""


def folder() -> Path:
    """The folder of this user's whiteboards, which is made where there is none.

    ``LLFSM_WHITEBOARDS``, else a folder in ``XDG_RUNTIME_DIR``, else one in /tmp. NoPlace: it belongs to somebody else,
    or others may write there.
    """
    named = os.environ.get("LLFSM_WHITEBOARDS")
    home = os.environ.get("XDG_RUNTIME_DIR")
    path = Path(named) if named else Path(home) / "llfsm" if home else Path(f"/tmp/llfsm-{os.getuid()}")  # noqa: S108
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
    except OSError as error:
        raise NoPlace(f"the folder {path} cannot be made: {error.strerror}") from None
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid() or status.st_mode & 0o022:
        raise NoPlace(f"{path} is not a folder of yours alone; LLFSM_WHITEBOARDS names another one")
    return path


def socket_path(name: str) -> Path:
    """The socket of the whiteboard of that name. NoPlace: it is no name, or see `folder`."""
    if not NAME.match(name):
        raise NoPlace(
            f"`{name[:64]}` is not a valid name of a whiteboard: letters, digits, `_`, `.` and `-`, at most 64"
        )
    return folder() / (name + SUFFIX)


def names() -> list[str]:
    """The whiteboards whose sockets are there, also those whose owners have died."""
    return sorted(path.name.removesuffix(SUFFIX) for path in folder().glob("*" + SUFFIX))
