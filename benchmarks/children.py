"""Run another program and measure what it took: wall-clock time, processor time and largest resident memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

LAUNCHER = str(Path(__file__).with_name("launch.py"))


class ChildFailed(Exception):
    """A program did not do what it was started for; the message says which and what it printed."""


class TooLong(ChildFailed):
    """It did not end within the time that it was given."""


@dataclass(frozen=True, slots=True)
class Usage:
    """What one run of a program took."""

    output: str
    errors: str
    """What it printed, on either channel."""
    code: int
    """Exit code; negative: the signal that ended it."""
    wall: float
    """Seconds."""
    cpu: float
    """Seconds of processor time, user and system, of the program and of those it waited for."""
    peak: int
    """Largest resident memory in bytes; at least the few megabytes of the process that starts it."""


def run(command: Sequence[str], *, timeout: float, cwd: Path | None = None) -> Usage:
    """Run `command` to its end; Python keeps bytecode, as it does for users.

    Raises ChildFailed when there is no such program, and TooLong when it takes longer than `timeout` seconds.
    """
    with (
        tempfile.TemporaryFile() as output,
        tempfile.TemporaryFile() as errors,
        tempfile.TemporaryFile() as report,
        subprocess.Popen(
            [sys.executable, "-I", "-S", LAUNCHER, str(report.fileno()), *command],
            stdout=output, stderr=errors, cwd=cwd, pass_fds=[report.fileno()], start_new_session=True,
            env={name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"},
        ) as launcher,
    ):  # fmt: skip
        try:
            launcher.wait(timeout)
        except BaseException as error:
            os.killpg(launcher.pid, signal.SIGKILL)
            if isinstance(error, subprocess.TimeoutExpired):
                raise TooLong(f"`{' '.join(command)}` took more than {timeout:.0f} s") from error
            raise
        for stream in (output, errors, report):
            stream.seek(0)
        text, messages, line = (stream.read().decode(errors="replace") for stream in (output, errors, report))
    if not line:
        raise ChildFailed(f"`{' '.join(command)}` could not be started:\n{messages[-500:]}")
    wall, cpu, peak, status = line.split()
    return Usage(
        text, messages, os.waitstatus_to_exitcode(int(status)), float(wall), float(cpu), int(peak) * 1024
    )  # fmt: skip


def expect(usage: Usage, command: Sequence[str], *codes: int) -> Usage:
    """The usage, of a run that ended with one of the codes. Raises ChildFailed."""
    if usage.code not in codes:
        printed = usage.output[-2000:] + usage.errors[-2000:]
        raise ChildFailed(f"`{' '.join(command)}` ended with code {usage.code}:\n{printed}")
    return usage
