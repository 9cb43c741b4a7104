"""The engine on the page of examples/engine: written to a file as it is, and tested as the page shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PYTHON = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.long
def test_the_engine_of_the_page_passes(tmp_path: Path) -> None:
    for block in PYTHON.findall((ROOT / "examples" / "engine" / "README.md").read_text(encoding="utf-8")):
        name = block.partition("\n")[0].removeprefix("# ")
        tmp_path.joinpath(name).write_text(block, encoding="utf-8")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["test_walker.py", "walker.py"]
    path = os.pathsep.join((str(tmp_path), str(ROOT)))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_walker.py"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert re.search(r"^\d+ passed", done.stdout.splitlines()[-1]), done.stdout


@pytest.mark.slow
def test_it_finds_faults_on_the_way(tmp_path: Path) -> None:
    code = (
        "from llfsm_verify.testing.conformance.known import KNOWN\n"
        "from llfsm_verify.verification import harness\n"
        "from llfsm_verify.checking.verdict import Options\n"
        "from walker import Walker\n"
        "for name in ('safety', 'last step', 'a range that is left'):\n"
        "    known = next(k for k in KNOWN if k.name == name)\n"
        "    result = harness.check('walker', Walker, known.problem(), Options())\n"
        "    print(*(p.verdict.value for p in result.properties), result.faults.verdict.value)\n"
    )
    (block, _) = PYTHON.findall((ROOT / "examples" / "engine" / "README.md").read_text(encoding="utf-8"))
    tmp_path.joinpath("walker.py").write_text(block, encoding="utf-8")
    path = os.pathsep.join((str(tmp_path), str(ROOT)))
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines() == [
        "unknown unknown unknown unknown unknown unknown",
        "unknown unknown unknown unknown unknown",
        "unknown unknown unknown violated",
    ], done.stderr
