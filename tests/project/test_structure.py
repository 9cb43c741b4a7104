"""The walls inside the package that import-linter cannot see: no cycles, deferred imports included."""

from __future__ import annotations

import ast

from tools import structure


def test_no_modules_import_each_other_in_a_circle():
    assert structure.cycles(structure.edges(structure.modules())) == []


def test_cycles_are_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"a"}}
    assert sorted(structure.cycles(graph)) == [["a", "b", "c"], ["d", "e"]]
    assert structure.cycles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_deferred_imports_count_and_those_for_types_do_not():
    text = "if TYPE_CHECKING:\n    import a\nelse:\n    import b\ndef f():\n    from c import d\n"
    assert {ast.unparse(i) for i in structure.imports(ast.parse(text))} == {"import b", "from c import d"}


def test_limits_are_asked_of_the_budget_in_force():
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in structure.modules().values()]
    assert structure.parameters_named(trees, "tick") == 0
