"""Distributions of others, as an installer leaves them, for a Python that looks for entry points."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]


class Site:
    """A folder with installed packages: modules, and what says of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def install(self, name: str, points: Mapping[str, Mapping[str, str]], **modules: str) -> None:
        """A package of this name, with entry points by their groups and the texts of its modules."""
        for module, text in modules.items():
            self.folder.joinpath(f"{module}.py").write_text(text, encoding="utf-8")
        info = self.folder / f"{name.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        info.joinpath("METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
        lines = [
            f"[{group}]\n" + "".join(f"{point} = {place}\n" for point, place in found.items())
            for group, found in points.items()
        ]
        info.joinpath("entry_points.txt").write_text("\n".join(lines), encoding="utf-8")

    def python(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """What a Python prints that has these packages."""
        path = os.pathsep.join((str(self.folder), str(ROOT)))
        return subprocess.run(
            [sys.executable, *arguments], cwd=ROOT, env={**os.environ, "PYTHONPATH": path},
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    def llfsm(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """The command line there."""
        return self.python("-m", "llfsm_verify", *arguments)
