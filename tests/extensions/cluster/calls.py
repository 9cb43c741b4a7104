"""What workers of a cluster do in tests."""

from __future__ import annotations

import os
import time
from pathlib import Path


def squared(number: int) -> int:
    return number * number


def noted(folder: str) -> int:
    """Begins, and goes on in Python code until it is interrupted."""
    mine = Path(folder) / f"{os.getpid()}"
    mine.with_suffix(".begun").touch()
    try:
        ends = time.monotonic() + 300
        while time.monotonic() < ends:
            time.sleep(0.01)
    except KeyboardInterrupt:
        mine.with_suffix(".interrupted").touch()
        raise
    return 0


def slowly(number: int) -> int:
    time.sleep(0.3)
    return number
