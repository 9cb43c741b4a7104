"""What everything in a step program is computed from: its dependence graph, and what reaches the observer through it.

The program dependence graph of J. Ferrante, K. Ottenstein, J. Warren (The program dependence graph and its use in
optimization, TOPLAS 9(3), 1987), without the order of statements: a variable depends on whatever any statement that
stores into it reads, and on the decisions around that statement. Its size is that of the program, and what is relevant
is found in one search.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass

from llfsm_verify.program.program import (
    INT64_MAX,
    INT64_MIN,
    Block,
    Const,
    Emit,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Let,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Unbounded,
)
from llfsm_verify.program.trees import branches


@dataclass(frozen=True, slots=True)
class Uses:
    """What evaluating an expression reads (names, once or more often), and whether it can leave 64 bits."""

    variables: tuple[str, ...]
    locals: tuple[str, ...]
    fails: bool


def uses(*expressions: Expr) -> Uses:
    """What evaluating these expressions takes, counting both sides of an Ite."""
    variables: list[str] = []
    names: list[str] = []
    fails = False
    stack: list[Expr] = list(expressions)
    seen = set[int]()
    while stack:
        e = stack.pop()
        if id(e) in seen:
            continue
        seen.add(id(e))
        if isinstance(e, Const):
            fails = fails or not INT64_MIN <= e.value <= INT64_MAX
        elif isinstance(e, Get):
            variables.append(e.var)
            if e.index is not None:
                stack.append(e.index)
        elif isinstance(e, Local):
            names.append(e.name)
        elif isinstance(e, Op):
            fails = fails or isinstance(e.type, Unbounded)
            stack.extend(e.args)
        else:
            stack += (e.condition, e.then, e.otherwise)
    return Uses(tuple(variables), tuple(names), fails)


def decided_by(statement: If | Switch) -> Expr:
    """What a decision evaluates."""
    return statement.condition if isinstance(statement, If) else statement.value


def blocks(program: Program) -> Iterator[tuple[Block, str | None]]:
    """Every block of a program, with the variable whose value selects it (None: it runs whatever the state)."""
    for slot in program.slots:
        yield slot.prologue, None
        for block in slot.blocks:
            yield block, slot.state
        yield slot.epilogue, None
        yield slot.canonical, None
    for process in program.processes:
        yield process.epilogue, None
    yield program.letter, None
    yield program.letter_stutter, None


@dataclass(frozen=True, slots=True)
class Relevant:
    """What can reach the observer: variables and outputs by name, locals by the `id` of their block and name."""

    variables: frozenset[str]
    locals: frozenset[tuple[int, str]]


def relevant(program: Program, also: Iterable[str] = ()) -> Relevant:
    """All that decides which process may step and whose turn it is, where cycles end, what letters and fairness show,
    and whether a step faults or leaves 64-bit arithmetic, and the variables `also`; time and memory are linear in the
    program's size."""
    graph = _Graph({v.name for v in program.vars if isinstance(v.type, Unbounded)})
    everywhere = graph.node()
    for block, selector in blocks(program):
        around = everywhere
        if selector is not None and block:
            around = graph.node()
            graph.sources[around].append(graph.variable(selector))
        graph.add(block, around)
    observed = [program.cycle, *also, *(a.output for a in program.atoms)]
    observed += [name for a in program.atoms for name in uses(a.expression).variables]
    for process in program.processes:
        observed += [process.turn] if process.ended is None else [process.turn, process.ended]
    for condition in program.fairness:
        observed += [condition.goal] if condition.premise is None else [condition.premise, condition.goal]
    marked = graph.reached(graph.variable(name) for name in observed)
    return Relevant(
        frozenset(name for name, node in graph.variables.items() if node in marked),
        frozenset(key for key, node in graph.locals.items() if node in marked),
    )


class _Graph:
    """Nodes are variables, locals, decisions and faults; `sources` says what each is computed from."""

    def __init__(self, unbounded: Container[str]) -> None:
        """`unbounded`: the variables of type `int`, which are stored in 64 bits."""
        self._unbounded = unbounded
        self.sources: list[list[int]] = []
        self.variables: dict[str, int] = {}
        self.locals: dict[tuple[int, str], int] = {}
        self.ends: list[int] = []
        """Nodes that can end the run: faults, and evaluations that can leave 64 bits."""

    def node(self) -> int:
        self.sources.append([])
        return len(self.sources) - 1

    def variable(self, name: str) -> int:
        found = self.variables.get(name)
        if found is None:
            found = self.variables[name] = self.node()
        return found

    def local(self, block: int, name: str) -> int:
        found = self.locals.get((block, name))
        if found is None:
            found = self.locals[block, name] = self.node()
        return found

    def add(self, block: Block, around: int) -> None:
        """The statements of a block that runs when the decision `around` says so. Raises no error at any depth."""
        key = id(block)
        todo: list[tuple[Stmt, int]] = [(s, around) for s in block]
        while todo:
            statement, decision = todo.pop()
            if isinstance(statement, Set):
                read = (statement.value,) if statement.index is None else (statement.value, statement.index)
                node = self.variable(statement.var)
                self._reads(node, read, key, decision)
                self._stores(node, statement.value, unbounded=statement.var in self._unbounded)
            elif isinstance(statement, Let):
                node = self.local(key, statement.local.name)
                self._reads(node, (statement.value,), key, decision)
                self._stores(node, statement.value, unbounded=isinstance(statement.local.type, Unbounded))
            elif isinstance(statement, Sample):
                self._reads(self.local(key, statement.local.name), (), key, decision)
            elif isinstance(statement, Fault):
                fault = self.node()
                self.ends.append(fault)
                self._reads(fault, (statement.when,), key, decision)
            elif not isinstance(statement, Emit):
                inner = self.node()
                self._reads(inner, (decided_by(statement),), key, decision)
                todo += [(s, inner) for branch in branches(statement) for s in branch]

    def _stores(self, node: int, value: Expr, *, unbounded: bool) -> None:
        """`node` gets this value: what `int` takes from a type of 64 bits without a sign may be too large for it."""
        kind = value.type
        if unbounded and isinstance(kind, Int) and not INT64_MIN <= kind.low <= kind.high <= INT64_MAX:
            self.ends.append(node)

    def _reads(self, node: int, read: tuple[Expr, ...], block: int, decision: int) -> None:
        """`node` is computed from these expressions, where `decision` says so."""
        used = uses(*read)
        sources = self.sources[node]
        sources.append(decision)
        sources.extend(map(self.variable, used.variables))
        sources.extend(self.local(block, name) for name in used.locals)
        if used.fails:
            self.ends.append(node)

    def reached(self, seeds: Iterable[int]) -> set[int]:
        """Everything that `seeds` and `ends` are computed from, themselves included."""
        todo = [*seeds, *self.ends]
        marked = set(todo)
        while todo:
            for source in self.sources[todo.pop()]:
                if source not in marked:
                    marked.add(source)
                    todo.append(source)
        return marked
