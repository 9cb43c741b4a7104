"""A compiler or an emulator, with all that it starts: ended when it is no longer wanted, whatever comes between."""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

MOST: Final = 1 << 24
"""Bytes that one may write."""
LOOK_SECONDS: Final = 0.05


@dataclass(frozen=True, slots=True)
class Ended:
    """The exit code of a command, and what it wrote."""

    code: int
    out: str
    errors: str


def ended(command: Sequence[str], seconds: float) -> Ended:
    """Run a command without input, in a session of its own, and end with it what it has started.

    TimeoutError: it takes longer; OverflowError: it writes more than `MOST` bytes; OSError: it cannot be run.
    """
    limit, written = time.monotonic() + seconds, (bytearray(), bytearray())
    pipe = subprocess.PIPE
    with (
        subprocess.Popen(  # noqa: S603 - the words that the user gave, without a shell
            command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, start_new_session=True
        ) as process,
        selectors.DefaultSelector() as waiting,
    ):
        try:
            for stream, into in zip((process.stdout, process.stderr), written, strict=True):
                assert stream is not None
                waiting.register(stream, selectors.EVENT_READ, into)
            gone = False
            while True:  # once more after its end, since it may have written meanwhile
                read = _read(waiting, 0 if gone else LOOK_SECONDS)
                if sum(map(len, written)) > MOST:
                    raise OverflowError
                if gone and not read:
                    break
                gone = process.poll() is not None
                if time.monotonic() > limit:
                    raise TimeoutError
        finally:
            with suppress(ProcessLookupError, PermissionError):  # all of its group have ended
                os.killpg(process.pid, signal.SIGKILL)
    return Ended(process.returncode, *(bytes(data).decode(errors="replace") for data in written))


def _read(waiting: selectors.BaseSelector, seconds: float) -> bool:
    """Whether there was something."""
    if not waiting.get_map():
        time.sleep(seconds)
        return False
    found = False
    for key, _ in waiting.select(seconds):
        data = os.read(key.fd, 1 << 16)
        key.data.extend(data)
        found |= bool(data)
        if not data:
            waiting.unregister(key.fileobj)
    return found
