"""Ctrl-C at any moment of a command: a word and exit code 130, or KeyboardInterrupt where a result can be saved."""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType

INTERRUPTED = 130
CONVERTING = "from_param"
"""Python code that ctypes has convert an argument: an exception comes out of it as another one, so Ctrl-C waits."""
SOON = 0.005
"""Seconds after which it is tried again."""
SHOW_CURSOR = b"\x1b[?25h"


def serve() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, or ends the process where that would go wrong.

    Raised while a module is imported it comes out as another error, or leaves a module half made for the next import;
    raised in a destructor it is printed with its traceback and forgotten. In both cases there is no result yet. Where
    the caller has Ctrl-C ignored (a command in the background of a shell), it stays ignored.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
        sys.unraisablehook = _unraisable


def finish() -> None:
    """The exit code is known: an interrupt while Python shuts down must not change it, nor print."""
    if signal.getsignal(signal.SIGINT) is _interrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt(_: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            _leave()
        if frame.f_code.co_name == CONVERTING:
            again = threading.Timer(SOON, os.kill, (os.getpid(), signal.SIGINT))
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _unraisable(unraisable: sys.UnraisableHookArgs) -> None:
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        _leave()
    sys.__unraisablehook__(unraisable)


def _leave() -> None:
    """End here and now. Rows already printed are out; the cursor, which a progress line hides, is shown again."""
    try:
        if os.isatty(2):
            os.write(2, SHOW_CURSOR)
        os.write(2, b"interrupted\n")
    except OSError:
        pass  # nobody reads it
    os._exit(INTERRUPTED)
