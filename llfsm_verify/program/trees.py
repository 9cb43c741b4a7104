"""Step programs as trees: walks over their expressions and statements, and the whole block of a slot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

from llfsm_verify.program.program import (
    Block,
    Const,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    Op,
    Program,
    Set,
    Stmt,
    Switch,
)
from llfsm_verify.program.terms import FOLD, wrap

T = TypeVar("T")


def branches(statement: If | Switch) -> tuple[Block, ...]:
    """The blocks of which a decision runs one."""
    if isinstance(statement, If):
        return statement.then, statement.otherwise
    return (*(block for _, block in statement.cases), statement.default)


def with_branches(statement: If | Switch, change: Callable[[Block], Block]) -> Stmt:
    """The decision with what `change` makes of its blocks."""
    if isinstance(statement, If):
        return If(statement.condition, change(statement.then), change(statement.otherwise))
    cases = tuple((number, change(block)) for number, block in statement.cases)
    return Switch(statement.value, cases, change(statement.default))


def without(block: Block, left_out: Callable[[Stmt], bool]) -> Block:
    """The block without the statements, the inner ones too, that are left out."""
    made = (
        with_branches(s, lambda b: without(b, left_out)) if isinstance(s, If | Switch) else s
        for s in block
        if not left_out(s)
    )
    return tuple(made)


def children(e: Expr) -> tuple[Expr, ...]:
    """The arguments of an expression."""
    match e:
        case Get(_, index, _):
            return () if index is None else (index,)
        case Op(_, args, _):
            return args
        case Ite(condition, then, otherwise, _):
            return condition, then, otherwise
    return ()


def fold(root: Expr, visit: Callable[[Expr, list[T]], T]) -> T:
    """`visit` every node after its arguments, with what it made of them; shared nodes once, without recursion."""
    done: dict[int, T] = {}
    stack: list[tuple[Expr, bool]] = [(root, False)]
    while stack:
        node, ready = stack.pop()
        if ready:
            done[id(node)] = visit(node, [done[id(c)] for c in children(node)])
        elif id(node) not in done:
            stack.append((node, True))
            stack.extend((c, False) for c in children(node))
    return done[id(root)]


def rebuilt(root: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """The expression with what `change` gives in place of each node for which it gives something."""

    def visit(node: Expr, args: list[Expr]) -> Expr:
        changed = change(node)
        return with_arguments(node, args) if changed is None else changed

    return fold(root, visit)


def spelt_out(root: Expr, locals_: Mapping[str, Expr]) -> Expr:
    """The expression with these in place of locals, by their names; each is one object wherever it stands."""
    return rebuilt(root, lambda node: locals_.get(node.name) if isinstance(node, Local) else None)


def with_arguments(node: Expr, args: Sequence[Expr]) -> Expr:
    """The node with other arguments, as many."""
    match node:
        case Get(name, _, kind):
            return Get(name, args[0] if args else None, kind)
        case Op(op, _, kind):
            return Op(op, tuple(args), kind)
        case Ite(_, _, _, kind):
            return Ite(args[0], args[1], args[2], kind)
    return node


def constant_of(root: Expr) -> int:
    """The value of an expression without variables, exact. ValueError: it has one."""

    def visit(node: Expr, args: list[int]) -> int:
        match node:
            case Const(value, _):
                return value
            case Op("wrap", _, Int(low, high)):
                return wrap(args[0], low, high)
            case Op(name, _, _):
                return FOLD[name](*args)
            case Ite():
                return args[1] if args[0] else args[2]
        raise ValueError(f"{node} is not constant")

    return fold(root, visit)


def nodes(root: Expr) -> Iterator[Expr]:
    """Every node, as often as it stands in the expression; see `distinct_nodes`."""
    stack = [root]
    while stack:
        node = stack.pop()
        yield node
        stack.extend(children(node))


def distinct_nodes(root: Expr) -> Iterator[Expr]:
    """The nodes of an expression in the order of `nodes`; one that stands in several places comes once."""
    stack, seen = [root], set[int]()
    while stack:
        node = stack.pop()
        if id(node) not in seen:
            seen.add(id(node))
            yield node
            stack.extend(children(node))


def statements(block: Block) -> Iterator[Stmt]:
    """Every statement of a block, the inner ones too."""
    stack = list(reversed(block))
    while stack:
        s = stack.pop()
        yield s
        for inner in parts(s):
            stack.extend(reversed(inner))


def parts(s: Stmt) -> tuple[Block, ...]:
    """The blocks inside a statement."""
    return branches(s) if isinstance(s, (If, Switch)) else ()


def expressions(s: Stmt) -> tuple[Expr, ...]:
    """The expressions that a statement itself evaluates."""
    match s:
        case Set(_, index, value):
            return (value,) if index is None else (index, value)
        case Let(_, value):
            return (value,)
        case If(condition, _, _):
            return (condition,)
        case Switch(value, _, _):
            return (value,)
        case Fault(_, when):
            return (when,)
    return ()


def ringlet(program: Program, index: int) -> Block:
    """What a ringlet of slot `index` does, without the letter."""
    slot = program.slots[index]
    process = program.processes[slot.process]
    state = next(v for v in program.vars if v.name == slot.state)
    body = Switch(Get(slot.state, None, state.type), tuple(enumerate(slot.blocks)))
    return (*slot.prologue, body, *slot.epilogue, *process.epilogue, *slot.canonical)


def stop_at_faults(block: Block, fine: Expr, instead: Callable[[Fault], Stmt]) -> Block:
    """A block with `instead` in the place of each check, in which nothing follows one that has made `fine` false.

    Blocks nest as deep as the source does, which the parser limits.
    """
    out: list[Stmt] = []
    part: list[Stmt] = []

    def close() -> None:
        out.extend(while_fine(fine, tuple(part)) if out else part)
        part.clear()

    for s in block:
        faults = any(isinstance(each, Fault) for each in statements((s,)))
        match s:
            case Fault():
                part.append(instead(s))
            case If() | Switch() if faults:
                part.append(with_branches(s, lambda inner: stop_at_faults(inner, fine, instead)))
            case _:
                part.append(s)
        if faults:
            close()
    close()
    return tuple(out)


def while_fine(fine: Expr, block: Block) -> Block:
    return (If(fine, block),) if block else ()
