"""The tests on docs/testing-with-hypothesis.md: written to files as they are, and run by pytest."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path("docs/testing-with-hypothesis.md").read_text(encoding="utf-8")
PYTHON = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHOWN = re.compile(r"^```text\n\$ pytest test_lights\.py\n\[…\]\n(.*?)\n\[…\]\n```$", re.MULTILINE | re.DOTALL)


def python(*words, cwd):
    done = subprocess.run(
        [sys.executable, *words], cwd=cwd, text=True, encoding="utf-8", check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        env={**os.environ, "PYTHONPATH": str(Path.cwd()), "COLUMNS": "400"},
    )  # fmt: skip
    return done.returncode, done.stdout


@pytest.mark.long
def test_the_page(tmp_path):
    for name in ("models", "properties"):
        (tmp_path / name).symlink_to(Path(name).resolve())
    lights, program, *others = PYTHON.findall(PAGE)
    blocks = {block.partition("\n")[0].removeprefix("# "): block for block in (lights, *others)}
    assert set(blocks) == {"test_lights.py", "test_crossing.py", "test_runs.py"}
    for name, block in blocks.items():
        (tmp_path / name).write_text(block, encoding="utf-8")
    # The output has all that the page shows of it, in this order.
    code, printed = python("-m", "pytest", "-q", "test_lights.py", cwd=tmp_path)
    assert code == 1, printed
    (shown,) = SHOWN.findall(PAGE)
    place = 0
    for part in shown.split("\n[…]\n"):
        place = printed.find(part, place)
        assert place >= 0, f"{part}\nis not in\n{printed}"
    # The page is formatted, and has other quotes than `repr`.
    assert all(line in printed.replace("'", '"') for line in program.splitlines())
    assert (tmp_path / "traces" / "both.trace.yaml").is_file()
    code, printed = python("-c", program, cwd=tmp_path)
    assert code == 1 and "RunFailed: both is violated" in printed
    code, printed = python("-m", "pytest", "-q", "test_crossing.py", "test_runs.py", cwd=tmp_path)
    assert code == 0, printed
