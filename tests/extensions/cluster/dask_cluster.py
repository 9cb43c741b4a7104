"""A Dask scheduler with workers on this machine, as processes of their own, on free ports of loopback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

PATIENCE = 120.0
ROOT = Path(__file__).parents[3]


class DaskCluster:
    """As a context, a scheduler; `start` starts workers. All end with it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.workers: dict[str, subprocess.Popen[bytes]] = {}
        self.address = ""

    def __enter__(self) -> Self:
        told = self.folder / "scheduler.json"
        words = ("--port", "0", "--no-dashboard", "--idle-timeout", "600 s", "--scheduler-file", str(told))
        self.scheduler = self._start("dask_scheduler", *words)

        def found() -> str:
            with suppress(OSError, ValueError):
                return str(json.loads(told.read_text())["address"])
            return ""

        self._wait(found)
        self.address = found()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in (*self.workers.values(), self.scheduler):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def start(self, *names: str, nanny: bool = False, environment: Mapping[str, str] | None = None) -> None:
        """Start workers of one thread, and wait until the scheduler knows them."""
        from distributed import Client

        for name in names:
            self.workers[name] = self._start(
                "dask_worker", self.address, "--name", name, "--nthreads", "1", "--no-dashboard",
                "--death-timeout", "60", "--nanny" if nanny else "--no-nanny",
                "--local-directory", str(self.folder / name),
                environment=environment,
            )  # fmt: skip
        with Client(self.address, set_as_default=False) as client:
            self._wait(lambda: set(names) <= {w["name"] for w in client.scheduler_info(-1)["workers"].values()})

    def kill(self, name: str) -> None:
        """End a worker as the system would that lacks memory."""
        os.killpg(self.workers[name].pid, signal.SIGKILL)
        self.workers[name].wait()

    def _start(self, module: str, *words: str, environment: Mapping[str, str] | None = None) -> subprocess.Popen[bytes]:
        settings = {
            "PYTHONPATH": str(ROOT), "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1", "PYTHONWARNINGS": "ignore",
        }  # fmt: skip
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--host", "127.0.0.1", *words]
        with (self.folder / f"{module}.log").open("ab") as log:
            return subprocess.Popen(
                command, env={**os.environ, **settings, **(environment or {})}, stdin=subprocess.DEVNULL, stdout=log,
                stderr=log, start_new_session=True, cwd=self.folder,
            )  # fmt: skip

    def _wait(self, done: object) -> None:
        assert callable(done)
        ends = time.monotonic() + PATIENCE
        while not done():
            logs = "".join(path.read_text() for path in self.folder.glob("*.log"))
            assert time.monotonic() < ends, logs
            for process in (self.scheduler, *self.workers.values()) if hasattr(self, "scheduler") else ():
                assert process.poll() is None or process.returncode < 0, logs
            time.sleep(0.05)
