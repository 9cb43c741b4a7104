"""Running NuSMV on a model, within so many seconds of processor time."""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
from pathlib import Path

from benchmarks.nusmv import SPECIFICATION, WAYS, commands, read
from tests.outside import needs, program

needs_nusmv = needs("nusmv")
SECONDS = 60
"""Of processor time, for one model. Those of the tests that are not slow take less than one."""


def _run(folder: Path, text: str, seconds: int, *flags: str) -> tuple[str, bool]:
    """What it says, and whether it came to its end within the limit. A crash fails the test."""
    (folder / "model.smv").write_text(text)
    # Its decision diagrams are deep, so that it needs stack; and it says what it knows at once only to a terminal.
    line = "$(command -v stdbuf >/dev/null && echo stdbuf -oL)"
    limits = f"ulimit -s unlimited 2>/dev/null; ulimit -S -t {seconds}; ulimit -H -t {seconds + 5}"
    command = ["sh", "-c", f"{limits}; exec {line} {shlex.join([program('nusmv'), *flags])}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    said = done.stdout + done.stderr
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return said, False
    assert done.returncode == 0 and "terminated by a signal" not in said and "aborting" not in said, said
    return said, True


def count(folder: Path, text: str, seconds: int = SECONDS) -> tuple[int, bool] | None:
    """The number of states, and whether some run faults; None: that takes longer."""
    said, ended = _run(folder, text, seconds, "-r", "model.smv")
    if not ended:
        return None
    found = re.search(r"^reachable states: (\S+) ", said, re.MULTILINE)
    assert found, said
    return int(float(found[1])), "-- invariant fault = 0  is false" in said


def answers(folder: Path, text: str, seconds: int = SECONDS) -> list[bool | None]:
    """Whether each LTLSPEC holds, in their order; None: finding that out takes longer."""
    specifications = SPECIFICATION.findall(text)
    (folder / "script").write_text("\n".join(commands(WAYS[0], "model.smv", specifications)) + "\n")
    said, ended = _run(folder, text, seconds, "-dcx", "-source", "script")
    verdicts = read(said, [name for name, _ in specifications])
    found = [{"holds": True, "violated": False, "unknown": None}[v] for v in verdicts.values()]
    assert not ended or None not in found, said
    return found
