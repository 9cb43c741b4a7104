"""What a worker of pytest-xdist says when it dies: how the process has ended, and the stacks of its threads.

xdist itself says only which test was running. The stacks that pytest writes go to standard error; after a test that
runs pytest within its own process they go where the output of tests is kept, and are lost with the worker. So each
worker has a file for them here, and is told at the beginning of each test to write there.
"""

from __future__ import annotations

import faulthandler
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

import pytest

PLACE = "last_words"
"""What a worker is told its file by."""
PATIENCE = 10.0
"""Seconds for a process to end whose connection is closed already. One that does not end has lost only that."""


class LastWords:
    """A plugin: in a worker it says where stacks go, and in the process that starts workers it prints them."""

    def __init__(self, config: pytest.Config) -> None:
        given: dict[str, str] = getattr(config, "workerinput", {})
        self._file = Path(given[PLACE]).open("w") if PLACE in given else None  # noqa: SIM115 - as long as the worker
        self._folder: Path | None = None
        self._deaths: list[tuple[str, str]] = []

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node):
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="last-words-"))
        node.workerinput[PLACE] = str(self._folder / node.gateway.id)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        if self._file is not None:
            faulthandler.enable(self._file)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node, error):
        if not error:
            return
        process = getattr(getattr(node.gateway, "_io", None), "popen", None)
        words = [f"its connection: {error}", f"its process: {'of another kind' if process is None else ended(process)}"]
        told = Path(node.workerinput[PLACE])
        words.append(told.read_text(errors="replace") if told.exists() and told.stat().st_size else "it left no stacks")
        self._deaths.append((node.gateway.id, "\n".join(words)))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        for worker, words in self._deaths:
            terminalreporter.section(f"last words of worker {worker}")
            terminalreporter.line(words)

    def pytest_unconfigure(self) -> None:
        if self._file is not None:
            faulthandler.disable()  # before the number of its descriptor is another file's
            self._file.close()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


def ended(process: subprocess.Popen[bytes]) -> str:
    """How a process has ended, in words."""
    try:
        code = process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        return f"{process.pid} still runs"
    if code >= 0:
        return f"{process.pid} has ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"{process.pid} was ended by {name}"
