"""Writing a large result in portions: limits and progress between them, and never half a file under its name."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import BinaryIO

from llfsm_verify.cli.io.files import write_whole
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.io.progress import StatusLine

ENDING = ("SIGTERM", "SIGHUP")
"""Signals that ask a process to end, where the system knows them."""


def write(pieces: Iterable[str | bytes], output: str | None, check: Callable[[], None] = lambda: None) -> None:
    """Write all pieces to the file `output`, or to standard output (None, "-"); see `write_whole`.

    SIGTERM leaves no file either. `check` is called between pieces; what it raises ends the writing. Raises
    DiagnosticError (E412, E422), and SystemExit on SIGTERM.
    """
    if output is None or output == "-":
        _to_standard_output(pieces, check)
        return

    def portions(file: BinaryIO) -> None:
        with _Line(output) as line:
            size = 0  # a pipe does not tell
            for piece in pieces:
                size += file.write(piece.encode() if isinstance(piece, str) else piece)
                line.update(size)
                check()

    with _ending_raises():
        write_whole(portions, output, "E422", "the structure")


def _to_standard_output(pieces: Iterable[str | bytes], check: Callable[[], None]) -> None:
    out = Output()
    for piece in pieces:
        out.plain(piece.decode() if isinstance(piece, bytes) else piece)
        if out.closed:
            return
        check()


@contextmanager
def _ending_raises() -> Iterator[None]:
    """Signals that would end the process at once raise SystemExit. Handlers of the caller's own stay as they are."""
    changed = []
    if threading.current_thread() is threading.main_thread():
        for name in ENDING:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _leave)
                changed.append(number)
    try:
        yield
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)


def _leave(number: int, _: FrameType | None) -> None:
    raise SystemExit(128 + number)  # as shells count


class _Line(StatusLine):
    """How much has been written."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def update(self, size: int) -> None:
        """Show that `size` bytes have been written, now and then."""
        self.show(lambda: f"writing {self._name}: {size / 2**20:,.0f} MiB, {time.monotonic() - self.started:.0f} s")
