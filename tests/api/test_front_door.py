"""`import llfsm_verify`: lazy, and all of it in sight of editors, type checkers and `dir`."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify import plug, testing
from llfsm_verify.lazily import places
from tests.outside import needs

HEAVY = ("numba", "z3", "numpy", "networkx", "llvmlite", "rich", "lark", "yaml", "pygraphviz", "hypothesis", "pandas")
LATER = ("z3", "networkx", "numba", "numpy", "pygraphviz", "hypothesis", "pandas")


def test_the_import_imports_nothing_else():
    code = f"""
import sys
sys.modules.pop("typing", None)
import llfsm_verify
print([name for name in sys.modules if name.startswith("llfsm_verify.") or name == "typing"])
print([name for name in {HEAVY!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n[]\n"


@pytest.mark.slow
def test_a_small_check_needs_neither_solver_nor_graphs():
    code = f"""
import sys
import llfsm_verify as lv
assert lv.load("models/traffic_lights/arrangement.yaml").check("G !(ns@GREEN && ew@GREEN)").verdict == "holds"
print([name for name in {LATER!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_every_name_is_there_and_listed():
    for name in lv.__all__:
        assert getattr(lv, name) is not None
    assert set(lv.__all__) <= set(dir(lv))
    assert len(set(lv.__all__)) == len(lv.__all__)


def called(value):
    """What it is and how it is called: a run of pytest inside this process may have imported a module twice."""
    return type(value).__name__, getattr(value, "__qualname__", None)


@pytest.mark.parametrize("module", [lv, plug, testing], ids=lambda module: module.__name__)
def test_what_type_checkers_see_is_what_is_imported(module):
    """The run time reads the same imports from a stub as Python's own parser does, and the stub exports all of them."""
    *imports, exported = ast.parse(Path(f"{module.__file__}i").read_text(encoding="utf-8")).body
    seen = {}
    for node in imports:
        assert isinstance(node, ast.ImportFrom) and node.module is not None
        for alias in node.names:
            assert (alias.asname or alias.name) not in seen
            seen[alias.asname or alias.name] = (node.module.removeprefix("llfsm_verify."), alias.name)
    assert seen == places(module.__name__)
    assert isinstance(exported, ast.Assign) and sorted(ast.literal_eval(exported.value)) == module.__all__
    assert module.__all__ == sorted(seen) and set(seen) <= set(dir(module))
    for name, (place, there) in seen.items():
        assert called(getattr(module, name)) == called(getattr(import_module(f"llfsm_verify.{place}"), there))
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        _ = module.lod


@pytest.mark.slow
def test_no_class_is_called_like_a_value_below():
    """The wrappers stand beside the frozen values in code and in messages, so their names differ."""
    own: set[str] = set()
    defined: set[str] = set()
    for path in Path("llfsm_verify").rglob("*.py"):
        names = re.findall(r"^class (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
        (own if path.parts[1] == "api" else defined).update(names)
    assert len(own) > 15 and own & defined == set()


SNIPPET = """
import llfsm_verify as lv
from tests.outside import needs

result = lv.load("x.yaml").check({"a": "G p"}, timeout=3.0, memory="2G", traces=2)
reveal_type(result["a"].verdict)
reveal_type(result["a"].trace)
reveal_type(lv.load("x.yaml").query("p").answer)
trace = result["a"].trace
assert trace is not None
reveal_type(trace.values(0))
off = lv.StateDefinition(transitions=[("x", "OFF")])
lamp = lv.MachineDefinition("Lamp", {"OFF": off, "ON": {"on_entry": "y = 1;"}})
lv.build("lamp", {"a": lamp, "b": lamp.bind(light="y")}, whiteboard={"x": {"type": "bool", "init": False}}).lint()
lv.load("x.yaml").check("G p", time_out=3)
lv.lod("x.yaml")
"""


@needs("mypy")
@pytest.mark.slow
def test_a_users_type_checker_sees_the_types(tmp_path):
    from mypy import api

    (tmp_path / "snippet.py").write_text(SNIPPET, encoding="utf-8")
    (tmp_path / "mypy.ini").write_text("[mypy]\nfollow_imports = silent\n", encoding="utf-8")
    words = ["--strict", "--config-file", str(tmp_path / "mypy.ini"), "--cache-dir", str(tmp_path / "cache")]
    said, errors, code = api.run([*words, str(tmp_path / "snippet.py")])
    seen = re.findall(r'Revealed type is "(.*)"', said)
    # Versions of mypy write a union in two ways.
    assert [re.sub(r"builtins\.|Union\[|\](?=$|\])", "", note).replace(", None", " | None") for note in seen] == [
        "llfsm_verify.checking.verdict.Verdict",
        "llfsm_verify.api.traces.TraceView | None",
        "llfsm_verify.api.answers.Reachability",
        "dict[str, int | bool | str | decimal.Decimal",
    ], said + errors
    wrong = [line for line in said.splitlines() if ": error:" in line]
    assert len(wrong) == 2 and code == 1, said + errors
    assert 'Unexpected keyword argument "time_out" for "check" of "Model"' in wrong[0]
    assert 'Module has no attribute "lod"' in wrong[1]
