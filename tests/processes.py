"""Waiting for other processes."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

SECONDS = 60
"""After so many seconds a wait is over, whatever came of it."""


def wait_for_processor_time(process: subprocess.Popen[Any], seconds: float) -> None:
    """Until a process has had so many seconds of processor time, or has ended: the same under any load.

    Where the system does not tell, twice as many seconds on the clock.
    """
    stat, end = Path(f"/proc/{process.pid}/stat"), time.monotonic() + SECONDS
    if not stat.exists():
        end = time.monotonic() + 2 * seconds
    while process.poll() is None and time.monotonic() < end:
        if stat.exists():
            user, system = stat.read_text().rpartition(")")[2].split()[11:13]
            if (int(user) + int(system)) / os.sysconf("SC_CLK_TCK") >= seconds:
                return
        time.sleep(0.01)


def wait_for_text_below(folder: Path, process: subprocess.Popen[Any]) -> None:
    """Until a file with something in it is in `folder`, or the process has ended."""
    end = time.monotonic() + SECONDS
    while process.poll() is None and time.monotonic() < end:
        try:
            if any(path.stat().st_size for path in folder.iterdir()):
                return
        except FileNotFoundError:
            pass  # between the listing and the look
        time.sleep(0.005)
