"""Waiting for other processes: for what they do, never for seconds; the limit of the test ends a wait in vain."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any


def processor_time(process: subprocess.Popen[Any]) -> float:
    """Seconds of a process that has not been waited for."""
    stat = Path(f"/proc/{process.pid}/stat")
    if stat.exists():
        user, system = stat.read_text().rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
    done = subprocess.run(["ps", "-o", "time=", "-p", str(process.pid)], capture_output=True, text=True, check=True)
    days, _, clock = done.stdout.strip().rpartition("-")
    seconds = 0.0
    for part in clock.split(":"):
        seconds = 60 * seconds + float(part)
    return seconds + 86_400 * int(days or 0)


def wait_for_processor_time(process: subprocess.Popen[Any], seconds: float) -> None:
    """Until a process has had so many seconds of processor time, or has ended: the same under any load."""
    while process.poll() is None and processor_time(process) < seconds:
        time.sleep(0.01)


def wait_for_text_below(folder: Path, process: subprocess.Popen[Any]) -> None:
    """Until a file with something in it is in `folder`, or the process has ended."""
    while process.poll() is None:
        try:
            if any(path.stat().st_size for path in folder.iterdir()):
                return
        except FileNotFoundError:
            pass  # between the listing and the look
        time.sleep(0.005)


def ended(process: subprocess.Popen[str]) -> tuple[str, str]:
    """What a process still prints until it ends: output and errors. It does not outlive the test."""
    try:
        output, errors = process.communicate()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    return output or "", errors or ""
