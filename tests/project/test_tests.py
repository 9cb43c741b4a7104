"""What every test has to do: assert something, and end."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FAILING = {
    "raises", "warns", "fail",  # pytest
    "assert_outcomes",  # pytester
    "validate", "check_schema",  # jsonschema
    "run_state_machine_as_test",  # Hypothesis
}  # fmt: skip
"""What fails by itself, by its last name."""


class Module:
    """A file of tests or helpers: its functions and classes, and those that it imports from such files."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.defined: dict[str, ast.stmt] = {}
        self.imported: dict[str, tuple[str, str]] = {}
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                self.defined[node.name] = node
            elif (
                isinstance(node, ast.ImportFrom) and node.module is not None and f"{node.module}.".startswith("tests.")
            ):
                self.imported |= {a.asname or a.name: (str(node.module), a.name) for a in node.names}

    @property
    def tests(self) -> list[ast.FunctionDef]:
        """Also those in classes; none in a file of helpers."""
        if not self.path.name.startswith("test_"):
            return []
        nodes = [n for d in self.defined.values() for n in (d.body if isinstance(d, ast.ClassDef) else [d])]
        return [n for n in nodes if isinstance(n, ast.FunctionDef) and n.name.startswith("test_")]


class Suite:
    """All files, by the names that others import them by."""

    def __init__(self, folder: Path) -> None:
        files = sorted(folder.rglob("*.py"))
        self.modules = {".".join(["tests", *f.relative_to(folder).with_suffix("").parts]): Module(f) for f in files}

    def can_fail(self, name: str, node: ast.stmt, seen: set[ast.stmt]) -> bool:
        """It asserts or raises, or what it names does."""
        seen.add(node)
        for part in ast.walk(node):
            if isinstance(part, (ast.Assert, ast.Raise)):
                return True
            if isinstance(part, ast.Attribute):
                whole = self._module(name, part.value)
                if part.attr in FAILING or (whole and self._named_can_fail(whole, part.attr, seen)):
                    return True
            if isinstance(part, ast.Name) and (part.id in FAILING or self._named_can_fail(name, part.id, seen)):
                return True
        return False

    def _module(self, name: str, value: ast.expr) -> str | None:
        """The file that a name in a file stands for, as in `from tests import helpers`."""
        found = self.modules[name].imported.get(value.id) if isinstance(value, ast.Name) else None
        return None if found is None else ".".join(found)

    def _named_can_fail(self, module: str, name: str, seen: set[ast.stmt]) -> bool:
        while module in self.modules and name in self.modules[module].imported:
            module, name = self.modules[module].imported[name]
        node = self.modules[module].defined.get(name) if module in self.modules else None
        return node is not None and node not in seen and self.can_fail(module, node, seen)

    def without_assertion(self) -> list[str]:
        return [
            f"{module.path}:{test.lineno}: {test.name}"
            for name, module in self.modules.items()
            for test in module.tests
            if not self.can_fail(name, test, set())
        ]


@pytest.mark.slow
def test_every_test_asserts_something() -> None:
    assert Suite(ROOT / "tests").without_assertion() == []


def test_a_test_without_an_assertion_is_found(tmp_path: Path) -> None:
    tmp_path.joinpath("helpers.py").write_text(
        "def loud(x):\n    if x:\n        raise ValueError\ndef quiet(x):\n    return x\n"
    )
    tmp_path.joinpath("test_it.py").write_text(
        "from tests import helpers\nfrom tests.helpers import loud, quiet as still\n"
        "def around(f):\n    f(1)\n"
        "def test_a():\n    around(still)\n"
        "def test_b():\n    around(loud)\n"
        "class TestC:\n"
        "    def test_c(self):\n        assert self\n"
        "    def test_d(self):\n        test_e()\n"
        "def test_e():\n    test_e()\n"
        "def test_f():\n    helpers.quiet(1)\n"
        "def test_g():\n    helpers.loud(1)\n"
    )
    found = Suite(tmp_path).without_assertion()
    assert [line.rpartition(" ")[2] for line in found] == ["test_a", "test_d", "test_e", "test_f"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "last", "says"),
    [
        ("pass", 1_000, "Failed: Timeout (>1.0s) from pytest-timeout"),
        # As where machine code hangs, no signal is served.
        ("signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])", 3, 'test_hanging.py", line 4 in test_hanging'),
    ],
)
def test_a_test_that_hangs_fails_and_shows_where(tmp_path: Path, before: str, last: int, says: str) -> None:
    path = tmp_path / "test_hanging.py"
    path.write_text(f"import signal\ndef test_hanging():\n    {before}\n    while True: pass\n")
    limits = ("-o", "timeout=1", "-o", f"faulthandler_timeout={last}")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-c", str(ROOT / "pyproject.toml"), *limits]
    done = subprocess.run([*command, str(path)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and says in done.stdout + done.stderr


def test_every_test_has_a_limit(pytestconfig: pytest.Config) -> None:
    assert float(pytestconfig.getini("timeout")) > 0
    assert float(pytestconfig.getini("faulthandler_timeout")) > float(pytestconfig.getini("timeout"))
