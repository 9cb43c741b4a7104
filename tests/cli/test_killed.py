"""Whatever ends a run while it saves: each file is the old one or the new one, whole, and the next run works."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow
KINDS = (
    "certificate", "traces", "new traces", "structure", "matrix", "drawing", "query", "init", "kept run", "update",
    "kernel", "checkpoint",
)  # fmt: skip


def hidden(name: str) -> bool:
    """A file that is not finished: nobody takes it for one that is."""
    file = Path(name).name
    return (file.startswith(".") and file != ".gitignore") or file.endswith(".tmp")


def visible(files: dict[str, str]) -> dict[str, str]:
    return {name: digest for name, digest in files.items() if not hidden(name)}


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_each_file_is_the_old_one_or_the_new_one(kind: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.cli.killing", kind, str(tmp_path / "folder")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    whole, *ended = map(json.loads, done.stdout.splitlines())
    usual = {"traces": 1, "new traces": 1, "certificate": 1, "checkpoint": 4}.get(kind, 0)
    assert whole["code"] == usual, whole["said"]
    assert not any(map(hidden, whole["after"])), whole["after"]
    assert visible(whole["after"]) != whole["before"]
    for run in ended:
        judge(kind, run, whole)
    ways = {mode: [run for run in ended if run["mode"] == mode] for mode in ("kill", "kill in writing", "full")}
    assert any(run["code"] is None for run in ways["kill"]) and any(
        run["code"] is None for run in ways["kill in writing"]
    )
    assert any("cannot be" in run["said"] for run in ways["full"])


def judge(kind: str, run: dict[str, Any], whole: dict[str, Any]) -> None:
    before, new, about = whole["before"], visible(whole["after"]), json.dumps(run, indent=1)
    code, said = run["again"]
    if kind == "checkpoint":
        # Checkpoints are saved by the clock: their content is judged by going on from it.
        assert run["code"] in (None, 4), about
        assert code == 0 and ("going on from" in said or "there is no checkpoint" in said), about
        assert run["mode"] != "full" or not any(map(hidden, run["left"])), about
        assert not any(map(hidden, run["after"])), about
        return
    for name, digest in visible(run["left"]).items():
        assert digest in (before.get(name), new.get(name)), (name, about)
    assert visible(run["left"]).keys() >= before.keys(), about
    if run["code"] is not None:
        assert not any(map(hidden, run["left"])), about
    if run["mode"] == "full" and run["code"] != whole["code"]:
        assert run["code"] == (1 if kind == "kernel" else 3) and "cannot be" in run["said"], about
        assert visible(run["left"]) == before, about
    left = visible(run["left"]).keys() - {"there/.gitignore"}  # one that is there is kept
    if kind == "init" and left:
        assert code == 3 and "E460" in said, about
        assert all(name.removeprefix("there/") in said for name in left), about
    else:
        assert code == whole["code"] and visible(run["after"]) == new, about
