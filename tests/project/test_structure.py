"""The walls inside the package that import-linter cannot see: no cycles, deferred imports and types included."""

from __future__ import annotations

import ast
from collections.abc import Collection
from pathlib import Path

import pytest

from llfsm_verify.verification.engines import ENGINES
from tools import structure


@pytest.mark.slow
def test_no_modules_import_each_other_in_a_circle():
    assert structure.cycles(structure.edges(structure.modules())) == []


def test_cycles_are_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"a"}}
    assert sorted(structure.cycles(graph)) == [["a", "b", "c"], ["d", "e"]]
    assert structure.cycles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_deferred_imports_and_those_for_types_count():
    text = "if TYPE_CHECKING:\n    import a\nelse:\n    import b\ndef f():\n    from c import d\n"
    assert {ast.unparse(i) for i in structure.imports(ast.parse(text))} == {
        "import a",
        "import b",
        "from c import d",
    }


def engines_named(tree: ast.Module, names: Collection[str]) -> list[str]:
    """Names of engines that stand as texts in a module."""
    found = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return [value for value in found if isinstance(value, str) and value in names]


def test_no_engine_is_known_by_its_name():
    names = [name for name in ENGINES if not ENGINES.entry(name).asks_others]
    assert len(names) == 4
    assert engines_named(ast.parse("if stage.engine == 'explicit':\n    pass"), names) == ["explicit"]
    own = ("llfsm_verify.engines.", "llfsm_verify.verification.engines")
    known = {
        module: named
        for module, path in structure.modules().items()
        if not module.startswith(own) and (named := engines_named(structure.parsed(path), names))
    }
    assert known == {}


def constants_twice(tree: ast.Module) -> list[str]:
    """Constants that a module assigns again: whoever imports them gets the last one."""
    targets = [t for s in tree.body if isinstance(s, ast.Assign) for t in s.targets]
    names = [
        n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name) and n.id[0].isalpha() and n.id.isupper()
    ]
    return sorted({name for name in names if names.count(name) > 1})


@pytest.mark.slow
def test_no_module_has_two_constants_of_one_name():
    assert constants_twice(ast.parse("A = 1\nB, A = 2, 3\n")) == ["A"]
    assert {m: t for m, path in structure.modules().items() if (t := constants_twice(structure.parsed(path)))} == {}


@pytest.mark.slow
def test_limits_are_asked_of_the_budget_in_force():
    trees = [structure.parsed(path) for path in structure.modules().values()]
    assert structure.parameters_named(trees, "tick") == 0


FRONTS = ("cli", "api", "report", "runtime.launch")


@pytest.mark.parametrize("room", FRONTS)
def test_no_function_of_the_fronts_is_large(room: str) -> None:
    """At most 60 lines, and 15 paths."""
    inside = f"{structure.PACKAGE}.{room}"
    files = [path for name, path in structure.modules().items() if f"{name}.".startswith(f"{inside}.")]
    assert files
    assert structure.large(map(structure.parsed, files), 60, 15) == []


def test_large_functions_are_found() -> None:
    tree = ast.parse("def f(x):\n    if x and x:\n        return [y for y in x if y]\n    return g() if x else 0\n")
    (function,) = tree.body
    assert isinstance(function, ast.FunctionDef)
    assert structure.paths_through(function) == 6
    assert structure.large([tree], 4, 6) == []
    assert structure.large([tree], 3, 6) == structure.large([tree], 4, 5) == ["f: 4 lines, 6 paths"]


INPUTS = """name: inputs
whiteboard: {a: &i {type: bool, role: input}, b: *i, c: *i, d: *i, e: *i}
machines: {m: {inline: {machine: M, states: [{name: A}]}}}
schedule: [m]
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "most"),
    [
        (["models/traffic_lights/arrangement.yaml", "properties/traffic_lights.ltl"], 1),
        (["models/traffic_lights/faulty.yaml", "-p", "G !(ns@GREEN && ew@GREEN)"], 2),
        (["models/traffic_lights/faulty.yaml", "-p", "G !ns@GREEN", "--engine", "bmc"], 2),
        (["models/traffic_lights/arrangement.yaml", "-p", "G !(ns@GREEN && ew@GREEN)", "--engine", "pdr"], 1),
    ],
)
def test_an_arrangement_is_lowered_once_and_again_only_for_what_is_performed(
    arguments: list[str], most: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Traces are performed with all bits kept."""
    lowered, _ = structure.profiled([*arguments, "-q"])
    assert lowered == most, capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(("inputs", "groups"), [("abc", 1), ("abcd", 2), ("abcde", 2)])
def test_an_arrangement_is_lowered_once_a_group(inputs: str, groups: int, tmp_path: Path) -> None:
    (tmp_path / "inputs.yaml").write_text(INPUTS, encoding="utf-8")
    properties = [part for name in inputs for part in ("-p", f"{name}0: G ({name} -> F m@A)")]
    lowered, _ = structure.profiled([str(tmp_path / "inputs.yaml"), *properties, "-q"])
    assert lowered == groups
