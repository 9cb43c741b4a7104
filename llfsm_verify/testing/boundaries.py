"""The values at which something changes: constants with which a step program compares what its choices say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from llfsm_verify.program.dependence import blocks, decided_by, uses
from llfsm_verify.program.program import (
    Block,
    Const,
    Emit,
    Expr,
    Fault,
    Get,
    Int,
    Ite,
    Let,
    Op,
    Program,
    Sample,
    Set,
    Switch,
)
from llfsm_verify.program.trees import branches

COMPARISONS = frozenset({"eq", "ne", "lt", "le", "gt", "ge"})
MAX_CONSTANTS = 200
"""An input that is compared with more constants is given these first ones."""

Node = str | tuple[int, str]
"""A variable by its name, a local by the `id` of its block and its name."""


@dataclass(frozen=True, slots=True)
class _Flow:
    """Where values go, whatever the order of statements, and what they are compared with."""

    targets: dict[Node, set[Node]] = field(default_factory=dict)
    sampled: dict[str, set[Node]] = field(default_factory=dict)
    """By choice: the locals that hold it."""
    compared: dict[Node, dict[int, None]] = field(default_factory=dict)


def boundaries(program: Program) -> Mapping[str, tuple[int, ...]]:
    """By the name of each input, age or free variable: the values around what it is compared with, and its extremes.

    Those are c - 1, c and c + 1 for each constant c of a comparison, or a switch, in which a value computed from the
    input stands (and of c divided by what it is multiplied by), as far as they are in its type; ascending, without
    repetitions. What a value is computed from is taken from all statements together, so there may be some too many.
    """
    flow = _Flow()
    for block, _ in blocks(program):
        _read(block, flow)
    found: dict[str, set[int]] = {}
    starts = [(c.input or c.name, c.type, flow.sampled.get(c.name, set())) for c in program.choices]
    starts += [(v.name, v.type, {v.name}) for v in program.vars if v.free and isinstance(v.type, Int)]
    for name, kind, nodes in starts:
        constants: dict[int, None] = {}
        for node in _reached(flow, nodes):
            constants |= flow.compared.get(node, {})
        near = {v for c in list(constants)[:MAX_CONSTANTS] for v in (c - 1, c, c + 1) if kind.low <= v <= kind.high}
        found.setdefault(name, set()).update(near | {kind.low, kind.high})
    return {name: tuple(sorted(values)) for name, values in found.items()}


def longest_wait(program: Program, limit: int = 512) -> int:
    """So many cycles may go by until a clock has run out, or a counter has counted: at least 16.

    That is twice the largest clock, or the largest extent of a variable, where that is at most `limit`.
    """
    found = 16
    for var in program.vars:
        if var.output or not isinstance(var.type, Int):
            continue
        extent = var.type.high - var.type.low
        if var.name.endswith(".$clock"):
            found = max(found, 2 * extent + 2)
        elif var.origin.kind not in ("control", "input") and not var.origin.labels and extent <= limit:
            found = max(found, extent + 1)
    return found


def _read(block: Block, flow: _Flow) -> None:
    key, todo = id(block), list(block)
    while todo:
        statement = todo.pop()
        if isinstance(statement, Sample):
            flow.sampled.setdefault(statement.choice, set()).add((key, statement.local.name))
        elif isinstance(statement, Let):
            _moves((key, statement.local.name), statement.value, key, flow)
        elif isinstance(statement, Set):
            _moves(statement.var, statement.value, key, flow)
            if statement.index is not None:
                _compares(statement.index, key, flow)
        elif isinstance(statement, Fault):
            _compares(statement.when, key, flow)
        elif not isinstance(statement, Emit):
            decided = decided_by(statement)
            _compares(decided, key, flow)
            if isinstance(statement, Switch):
                for node in _nodes(decided, key):
                    flow.compared.setdefault(node, {}).update((value, None) for value, _ in statement.cases)
            todo += [s for branch in branches(statement) for s in branch]


def _moves(target: Node, value: Expr, key: int, flow: _Flow) -> None:
    _compares(value, key, flow)
    for node in _nodes(value, key):
        flow.targets.setdefault(node, set()).add(target)


def _compares(expression: Expr, key: int, flow: _Flow) -> None:
    """Note the constants of every comparison in `expression`."""
    for part in _parts(expression):
        if isinstance(part, Op) and part.op in COMPARISONS:
            constants = {p.value: None for p in _parts(part) if isinstance(p, Const)}
            factors = [f for p in _parts(part) if isinstance(p, Op) and p.op == "mul" for f in p.args]
            sizes = [f.value for f in factors if isinstance(f, Const) and f.value > 1]
            constants |= {c // size: None for size in sizes for c in constants}
            for node in _nodes(part, key):
                flow.compared.setdefault(node, {}).update(constants)


def _parts(expression: Expr) -> Iterator[Expr]:
    stack = [expression]
    while stack:
        part = stack.pop()
        yield part
        if isinstance(part, Op):
            stack += part.args
        elif isinstance(part, Ite):
            stack += (part.condition, part.then, part.otherwise)
        elif isinstance(part, Get) and part.index is not None:
            stack.append(part.index)


def _nodes(expression: Expr, key: int) -> Iterator[Node]:
    used = uses(expression)
    yield from used.variables
    yield from ((key, name) for name in used.locals)


def _reached(flow: _Flow, nodes: set[Node]) -> set[Node]:
    """All that is computed from some nodes, themselves included."""
    todo, marked = list(nodes), set(nodes)
    while todo:
        for target in flow.targets.get(todo.pop(), ()):
            if target not in marked:
                marked.add(target)
                todo.append(target)
    return marked
