from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from tests.outside import demand

HEAVY = ("llvmlite", "rich", "lark", "yaml", "numpy", "numba", "networkx", "pygraphviz", "z3", "cvc5", "hypothesis")
LATER = ("numpy", "numba", "networkx", "z3", "cvc5", "pygraphviz", "hypothesis", "pytest")


@pytest.mark.parametrize(
    ("main", "arguments"),
    [
        *(("main", f"{command} --help".split()) for command in ("", "verify", "query", "monitor", "draw", "simulate")),
        ("main", ["--version"]),
        ("main_verify", ["--help"]),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_help_imports_nothing_heavy(main, arguments):
    code = f"""
import sys
from llfsm_verify.cli import {main} as main
try:
    main({arguments!r})
except SystemExit as leaving:
    assert leaving.code == 0
print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout.startswith(("usage: llfsm", "llfsm")) and done.stderr == "[]\n"


def test_a_small_verification_needs_neither_numpy_nor_z3():
    code = f"""
import sys
from llfsm_verify.cli import main
code = main(["verify", "models/traffic_lights/arrangement.yaml", "properties/traffic_lights.ltl", "-q"])
assert code == 0
print([name for name in {LATER!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "[]"


def test_every_module_says_what_idea_it_holds():
    files = [path for path in Path("llfsm_verify").rglob("*.py") if path.read_text()]
    assert len(files) > 40
    for path in files:
        assert path.read_text().startswith('"""'), path


@pytest.mark.slow
def test_the_wheel_has_everything(tmp_path):
    tracked = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout.split()
    package = [name for name in tracked if name.startswith("llfsm_verify/")]
    # Built from a copy: what earlier builds left in the work tree must not get in.
    for name in ("pyproject.toml", "README.md", *package):
        (tmp_path / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(name, tmp_path / "tree" / name)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir"]
    done = subprocess.run(
        [*command, str(tmp_path), str(tmp_path / "tree")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("llfsm_verify-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert sorted(n for n in names if n.startswith("llfsm_verify/")) == sorted(package)
    assert any(n.endswith(".lark") for n in names) and any(n.endswith("result.schema.json") for n in names)
    text = zipfile.ZipFile(wheel).read(next(n for n in names if n.endswith("entry_points.txt"))).decode()
    assert "[pytest11]\nllfsm = llfsm_verify.testing.pytest_plugin" in text
    assert "llfsm = llfsm_verify.cli:main" in text and "llfsm-verify = llfsm_verify.cli:main_verify" in text


def test_layers_hold():
    demand("import-linter")
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_each_ignored_rule_has_its_reason():
    lines = Path("pyproject.toml").read_text().split("ignore = [", 1)[1].split("]", 1)[0].strip().splitlines()
    assert len(lines) == len(tomllib.loads(Path("pyproject.toml").read_text())["tool"]["ruff"]["lint"]["ignore"])
    assert all(" # " in line for line in lines)


def test_nothing_of_a_machine_stands_in_the_files():
    done = subprocess.run(["git", "ls-files", "-z"], capture_output=True, text=True, check=True)
    texts = [Path(name) for name in done.stdout.split("\0") if name and Path(name).is_file()]
    assert len(texts) > 50
    home = "/" + "root/"
    for path in texts:
        assert home.encode() not in path.read_bytes(), path
