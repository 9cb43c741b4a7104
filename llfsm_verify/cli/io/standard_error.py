"""Standard error that cannot be written (its reader has gone, the disk is full): no exit code depends on it."""

from __future__ import annotations

import io
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Buffer


class _Dropping(io.FileIO):
    def write(self, data: Buffer, /) -> int:
        """Write what can be written; all counts as written."""
        try:
            written = super().write(data)
        except OSError:
            written = None
        return memoryview(data).nbytes if written is None else written


def drop_what_no_one_reads() -> None:
    """From now on a failure to write to the standard error of this process is no error."""
    stream = sys.__stderr__
    if stream is None or sys.stderr is not stream:
        return
    raw = _Dropping(stream.fileno(), "w", closefd=False)
    encoding = stream.encoding
    sys.stderr = io.TextIOWrapper(io.BufferedWriter(raw), encoding, errors="backslashreplace", line_buffering=True)
