"""Where the time of a command went (`--timings`), on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from llfsm_verify.stages import record


@contextmanager
def told() -> Iterator[None]:
    """Measure what is done within, and say it at the end, whatever that is."""
    start = time.process_time()
    recording = record()
    try:
        yield
    finally:
        recording.now()
        rows = {"starting: Python, imports and arguments": (start, None), **recording.spent}
        width = max(map(len, rows))
        lines = [f"{'where the time went'.ljust(width)}  {'CPU s':>8}  {'wall s':>8}"]
        for name, (cpu, wall) in rows.items():
            lines.append(f"{name.ljust(width)}  {cpu:8.3f}  {'' if wall is None else f'{wall:8.3f}'}".rstrip())
        whole = time.process_time()
        lines.append(f"{'the whole process'.ljust(width)}  {whole:8.3f}")
        print("\n".join(lines), file=sys.stderr)
