"""`llfsm` in forks of one process that has imported it: each begins like a new process, but for the imports.

`python -m tests.forked` is that process. It has one thread, and has run nothing.
"""

from __future__ import annotations

import atexit
import json
import os
import pkgutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

PACKAGES = ("llfsm_verify.cli.commands", "llfsm_verify.engines")


class Forks:
    """Runs commands, one after the other."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def llfsm(self, arguments: Sequence[str], folder: Path) -> tuple[int, str]:
        """The exit code of `llfsm` in a folder, and what it prints to both streams."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps([list(arguments), str(folder)]) + "\n")
        self._process.stdin.flush()
        code, output = json.loads(self._process.stdout.readline())
        return code, output


@contextmanager
def forks() -> Iterator[Forks]:
    """A process to fork, until the end of the block."""
    command = [sys.executable, "-m", "tests.forked"]
    known = dict(os.environ)  # GNU readline, which pytest imports, sets COLUMNS where Python does not see it
    with subprocess.Popen(command, env=known, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield Forks(process)
        assert process.stdin is not None
        process.stdin.close()


def _forked(arguments: list[str], folder: str) -> tuple[int, str]:
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        for number in (1, 2):
            os.dup2(writing, number)
        os.close(reading)
        os.close(writing)
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", 1, encoding="utf-8", closefd=False)  # noqa: SIM115
        os.chdir(folder)
        sys.argv = ["llfsm", *arguments]
        code = 70
        try:
            code = import_module("llfsm_verify.cli").main()
        except SystemExit as leaving:
            code = int(leaving.code or 0)
        finally:
            atexit._run_exitfuncs()  # which `os._exit` leaves out
            sys.stdout.flush()
            os._exit(code)
    os.close(writing)
    with open(reading, encoding="utf-8") as pipe:
        output = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), output


def main() -> None:
    for package in map(import_module, PACKAGES):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            import_module(module.name)
    for line in sys.stdin:
        sys.stdout.write(json.dumps(_forked(*json.loads(line))) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
