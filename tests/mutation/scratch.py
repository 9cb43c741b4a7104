"""Copies of the project in which mutants run, so that the work tree is never changed."""

from __future__ import annotations

import compileall
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from py_compile import PycInvalidationMode
from typing import Any

KERNELS = "kernels of this copy"
LEFT_OUT = (".git", ".venv", ".mutants", "__pycache__", "*.egg-info", ".*_cache", ".hypothesis", "build", "dist")


@dataclass(frozen=True, slots=True)
class Project:
    """What is mutated and what it is tested with."""

    root: Path
    package: str
    tests: str = "tests"
    beside: tuple[str, ...] = ()
    """Folders that the tests read beside their own."""
    prepare: str = ""
    """Python that compiles what is compiled once for an installation and prints the folder in which it is kept."""
    compiled: str = ""
    """The folder whose functions run as machine code, which coverage does not see, ..."""
    caller: str = ""
    """... and the file through which they are called."""
    whole: tuple[str, ...] = ()
    """Folders and files of the tests that look at the project as a whole."""
    left_out: tuple[str, ...] = ()
    """Folders of the tests that no mutant is tried with."""

    def test_files(self) -> list[Path]:
        """The test files, in alphabetical order."""
        left_out = [self.root / folder for folder in self.left_out]
        found = sorted((self.root / self.tests).rglob("test_*.py"))
        return [path for path in found if not any(path.is_relative_to(folder) for folder in left_out)]

    def sources(self) -> list[Path]:
        """The modules of the package."""
        return sorted((self.root / self.package).rglob("*.py"))

    def kernels(self, root: Path) -> Path:
        """The folder of compiled kernels of a copy, each for the unmutated source."""
        return root / KERNELS

    def is_compiled(self, file: str) -> bool:
        """Whether the functions of a file run as machine code."""
        return bool(self.compiled) and file.startswith(self.compiled)

    def helpers(self) -> list[Path]:
        """What else is in the folder of the tests and is Python."""
        left_out = [self.root / folder for folder in self.left_out]
        found = sorted((self.root / self.tests).rglob("*.py"))
        return [
            path
            for path in found
            if not path.name.startswith("test_") and not any(path.is_relative_to(folder) for folder in left_out)
        ]


def copy_of(project: Project, folder: Path) -> Path:
    """The project, copied below `folder`; the root of the copy.

    Its modules are compiled with the hash of their source in the file: a mutant may have the size of the original and
    be written in the same second, which is all that Python looks at otherwise.
    """
    root = folder / "project"
    shutil.copytree(project.root, root, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
    compileall.compile_dir(
        root / project.package, quiet=2, invalidation_mode=PycInvalidationMode.CHECKED_HASH, workers=1
    )
    kernels = _prepared(project) if project.prepare else None
    if kernels is None:
        (root / KERNELS).mkdir()
    else:
        shutil.copytree(kernels, root / KERNELS)
    return root


def copy_again(copied: Path, folder: Path) -> Path:
    """A copy of a copy; its root."""
    return Path(shutil.copytree(copied / "project", folder / "project", symlinks=True))


def _prepared(project: Project) -> Path:
    command = [sys.executable, "-c", project.prepare]
    done = subprocess.run(command, cwd=project.root, capture_output=True, text=True, check=True)
    return Path(done.stdout.strip())


def environment(
    project: Project, root: Path, plan: Path | None = None, kernels: Path | None = None, *, quick: bool = True
) -> dict[str, str]:
    """The variables for pytest in a copy: what it and the processes it starts import is the copy.

    Compiled kernels are kept in the folder `kernels`, else in the copy; `quick` draws fewer random examples.
    """
    return {
        **os.environ,
        "PYTHONPATH": str(root),
        "PYTHONHASHSEED": "0",
        "LLFSM_QUICK": "1" if quick else "0",
        "LLFSM_CACHE": str(kernels or root / KERNELS),
        "MUTANTS_PACKAGE": project.package,
        "MUTANTS_PLAN": str(plan or ""),
    }


def journal(path: Path) -> list[dict[str, Any]]:
    """What the plugin wrote; a line cut short by the end of its process is left out."""
    entries = []
    for line in _lines(path):
        try:
            entries.append(json.loads(line))
        except json.JSONDecodeError:
            pass
    return entries


def _lines(path: Path) -> Iterable[str]:
    return path.read_text(encoding="utf-8").splitlines() if path.is_file() else ()
