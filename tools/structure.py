"""Figures of the source's structure: import cycles, lowerings of a check, files that a check runs, lengths of files.

`python -m tools.structure` prints them. Imports are read from the syntax tree, deferred ones and those under
`TYPE_CHECKING` included. Calls are counted by a profile of one plain check.
"""

from __future__ import annotations

import ast
import inspect
import statistics
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "llfsm_verify"
DECISIONS = (ast.If, ast.For, ast.While, ast.ExceptHandler, ast.IfExp, ast.match_case, ast.Assert)


def modules(root: Path = ROOT) -> dict[str, Path]:
    """The modules of the package by dotted name."""
    found: dict[str, Path] = {}
    for path in sorted((root / PACKAGE).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def parsed(path: Path) -> ast.Module:
    """The syntax tree of a file, read once."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imports(tree: ast.Module) -> Iterator[ast.Import | ast.ImportFrom]:
    """The import statements of a module, deferred ones and those under TYPE_CHECKING included."""
    return (node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom))


def edges(known: dict[str, Path]) -> dict[str, set[str]]:
    """Which modules each module imports, of those known."""
    found: dict[str, set[str]] = {}
    for name, path in known.items():
        targets: set[str] = set()
        for statement in imports(parsed(path)):
            if isinstance(statement, ast.Import):
                targets.update(alias.name for alias in statement.names)
            elif statement.module is not None:
                for alias in statement.names:
                    inner = f"{statement.module}.{alias.name}"
                    targets.add(inner if inner in known else statement.module)
        found[name] = {target for target in targets if target in known and target != name}
    return found


def cycles(graph: dict[str, set[str]]) -> list[list[str]]:
    """The strongly connected components of more than one module (Tarjan 1972, with a stack of its own)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    open_: list[str] = []
    found: list[list[str]] = []
    for start, first in graph.items():
        work: list[tuple[str, Iterator[str]]] = [] if start in order else [(start, iter(sorted(first)))]
        if work:
            order[start] = low[start] = len(order)
            open_.append(start)
        while work:
            node, targets = work[-1]
            target = next(targets, None)
            if target is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == order[node]:
                    at = open_.index(node)
                    component = open_[at:]
                    del open_[at:]
                    low.update(dict.fromkeys(component, len(graph)))
                    if len(component) > 1:
                        found.append(sorted(component))
            elif target not in order:
                order[target] = low[target] = len(order)
                open_.append(target)
                work.append((target, iter(sorted(graph[target]))))
            else:
                low[node] = min(low[node], low[target] if low[target] < len(graph) else low[node])
    return found


def parameters_named(trees: Iterable[ast.Module], name: str) -> int:
    """Functions that have a parameter of this name."""
    count = 0
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                given = node.args
                count += any(a.arg == name for a in (*given.posonlyargs, *given.args, *given.kwonlyargs))
    return count


def paths_through(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Paths through a function, those of functions in it included: one more than its decisions."""
    count = 1
    for node in ast.walk(function):
        if isinstance(node, ast.BoolOp):
            count += len(node.values) - 1
        elif isinstance(node, ast.comprehension):
            count += 1 + len(node.ifs)
        else:
            count += isinstance(node, DECISIONS)
    return count


def large(trees: Iterable[ast.Module], lines: int, most: int) -> list[str]:
    """Functions of more lines, or of more paths."""
    found = []
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                long = (node.end_lineno or node.lineno) - node.lineno + 1
                if long > lines or paths_through(node) > most:
                    found.append(f"{node.name}: {long} lines, {paths_through(node)} paths")
    return found


def lengths(paths: Iterable[Path]) -> list[int]:
    return sorted(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def profiled(arguments: list[str]) -> tuple[int, int]:
    """Of one check: how often an arrangement is lowered, and how many files of ours run a function."""
    from llfsm_verify.cli import main_verify

    files: set[str] = set()
    lowered = 0

    def watch(frame: object, event: str, _argument: object) -> None:
        nonlocal lowered
        if event == "call":
            code = frame.f_code  # type: ignore[attr-defined]
            if f"{PACKAGE}/" in code.co_filename and code.co_flags & inspect.CO_OPTIMIZED:
                files.add(code.co_filename)
                if code.co_name == "lower" and code.co_filename.endswith("semantics/lowering.py"):
                    lowered += 1

    sys.setprofile(watch)
    try:
        main_verify(arguments)
    finally:
        sys.setprofile(None)
    return lowered, len(files)


def main() -> None:
    known = modules()
    trees = [parsed(path) for path in known.values()]
    found = cycles(edges(known))
    source, tests = lengths(known.values()), lengths((ROOT / "tests").rglob("*.py"))
    print(f"import cycles: {len(found)} groups, {sum(map(len, found))} files")
    for component in found:
        print("  " + ", ".join(name.removeprefix(PACKAGE + ".") for name in component))
    lights, rules = "models/traffic_lights/arrangement.yaml", "properties/traffic_lights.ltl"
    print(f"functions with a parameter `tick`: {parameters_named(trees, 'tick')}")
    filled = [n for n in source if n]
    print(
        f"source: {len(source)} files, {sum(source):,} lines, median {statistics.median(filled):g}, "
        f"p90 {filled[int(len(filled) * 0.9)]}, longest {filled[-1]}"
    )
    print(f"tests: {len(tests)} files, {sum(tests):,} lines, {sum(tests) / sum(source):.2f} of the source")
    for says, arguments in (
        ("all hold", [lights, rules, "-q"]),
        ("one is violated", [lights.replace("arrangement", "faulty"), "-p", "G !(ns@GREEN && ew@GREEN)", "-q"]),
    ):
        lowered, run = profiled(arguments)
        print(f"a check in which {says}: {lowered} lowerings, functions of {run} files run")


if __name__ == "__main__":
    main()
