"""The worked example of docs/monitors.md: its files and commands, in order."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path("docs/monitors.md")
TEXT = re.compile(r"^```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
YAML = re.compile(r"^```yaml\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def printed_by(command: str, folder: Path) -> str:
    words = shlex.split(command)
    verify = ["verify"] if words[0] == "llfsm-verify" else []
    done = subprocess.run(
        [sys.executable, "-m", "llfsm_verify", *verify, *words[1:]],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path.cwd()), "COLUMNS": "200"},
    )
    return done.stdout


@pytest.mark.slow
def test_the_worked_example(tmp_path):
    (tmp_path / "models").symlink_to(Path("models").resolve())
    page = PAGE.read_text(encoding="utf-8")
    machine, arrangement = YAML.findall(page)
    assert arrangement.startswith("# monitored.yaml\n")
    (tmp_path / "monitored.yaml").write_text(arrangement, encoding="utf-8")
    blocks = TEXT.findall(page)
    assert len(blocks) == 3
    for block in blocks:
        line, _, shown = block.partition("\n")
        assert line.startswith("$ ")
        output = printed_by(line[2:], tmp_path)
        if "[…]" not in shown:
            assert output.strip() == shown.strip()
            continue
        # Of a table the page shows the heading and the last rows.
        first, last = shown.split("\n[…]\n")
        assert output.startswith(first + "\n") and output.rstrip().endswith("\n" + last.rstrip())
    written = (tmp_path / "both.machine.yaml").read_text(encoding="utf-8").splitlines(keepends=True)
    assert "".join(part for part in written if not part.startswith("#")) == machine
    moved = arrangement.replace("[timer, ns, monitor, ew]", "[timer, ns, ew, monitor]")
    (tmp_path / "monitored.yaml").write_text(moved, encoding="utf-8")
    output = printed_by("llfsm-verify monitored.yaml -p 'G !monitor.violated' --quiet", tmp_path)
    assert output.startswith("holds ")


@pytest.mark.slow
def test_the_benchmark_runs(capsys):
    from benchmarks import monitors

    monitors.letters_table(300, 1)
    monitors.simulation_table(300, 1)
    printed = capsys.readouterr().out
    assert "order" in printed and "a step and property" in printed
