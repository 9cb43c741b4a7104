"""Ctrl-C at any moment of a command: a word and exit code 130, or KeyboardInterrupt where a result can be saved."""

from __future__ import annotations

import os
import signal
from types import FrameType

from llfsm_verify import interrupts

INTERRUPTED = 130
SHOW_CURSOR = b"\x1b[?25h"


def serve() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, or ends the process where that would go wrong.

    Raised while a module is imported it comes out as another error, or leaves a module half made for the next import:
    there is no result yet. Elsewhere it waits where it must (`interrupts`). Where the caller has Ctrl-C ignored (a
    command in the background of a shell), it stays ignored.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        interrupts.serve(_leave, _interrupt)


def finish() -> None:
    """The exit code is known: an interrupt while Python shuts down must not change it, nor print."""
    if signal.getsignal(signal.SIGINT) is _interrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt(number: int, frame: FrameType | None) -> None:
    caller = frame
    while caller is not None:
        if caller.f_code.co_filename.startswith("<frozen importlib"):
            _leave()
        caller = caller.f_back
    interrupts.interrupt(number, frame)


def _leave() -> None:
    """End here and now. Rows already printed are out; the cursor, which a progress line hides, is shown again."""
    try:
        if os.isatty(2):
            os.write(2, SHOW_CURSOR)
        os.write(2, b"interrupted\n")
    except OSError:
        pass  # no one reads it
    os._exit(INTERRUPTED)
