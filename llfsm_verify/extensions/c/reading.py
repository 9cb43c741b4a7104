"""Blocks rearranged for a reader: what a state does on its transitions stands in one chain of decisions.

The step program first finds the number of the transition that fires, and then decides on it. Where the number is used
for nothing else, what follows from it goes where it is found. This is a form of the same statements: each of them runs
with the same values in the same order, but for stores of the number, which nothing between them reads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.plug import (
    Block,
    Const,
    Emit,
    Expr,
    Fault,
    If,
    Int,
    Let,
    Local,
    Op,
    Set,
    Stmt,
    Switch,
    distinct_nodes,
    expressions,
    rebuilt,
    statements,
    with_branches,
)

LONGEST = 16
"""Decisions in one chain: some compilers count what stands within each other."""


def readable(block: Block) -> Block:
    """The block in the form that is easiest to read."""
    return _guards_in_place(_chains(block))


def _chains(block: Block) -> Block:
    out: list[Stmt] = []
    for number, statement in enumerate(block):
        if isinstance(statement, Let) and statement.value == Const(0, statement.value.type):
            made = _ringlet(statement.local, block[number + 1 :])
            if made is not None:
                return (*out, *made)
        out.append(with_branches(statement, _chains) if isinstance(statement, If | Switch) else statement)
    return tuple(out)


# ---------------------------------------------------------------- one chain


@dataclass(frozen=True, slots=True)
class _Link:
    """Statements, and the number that holds after them where `condition` does (None: always)."""

    before: Block
    condition: Expr | None
    then: Block
    number: int


def _compares(statement: Stmt, name: str, local: Local) -> bool:
    """Whether it decides on `local == 0` or `local != 0`."""
    if not isinstance(statement, If) or not isinstance(statement.condition, Op):
        return False
    condition = statement.condition
    return condition.op == name and condition.args[0] == local and condition.args[1] == Const(0, condition.args[1].type)


def _ringlet(local: Local, rest: Block) -> Block | None:
    """`rest`, in which a local that is 0 gets the number of a transition, as one chain; None: it has another form."""
    last = next((i for i, s in enumerate(rest) if _compares(s, "ne", local)), None)
    if last is None or any(_mentions(s, local) for s in rest[last + 1 :]):
        return None
    decision = rest[last]
    assert isinstance(decision, If)
    start = next((i for i in range(last, 0, -1) if not _stores(rest[i - 1], local)), 0)
    found = _links(rest[:start], local)
    if found is None or len(found[0]) > LONGEST:
        return None
    links, otherwise = found
    stored, ends = rest[start:last], decision.then
    switch, *leaving = ends or (None,)
    if not isinstance(switch, Switch) or switch.value != local or switch.default:
        return None
    arms = dict(switch.cases)
    whole = len(links) == 1 or not any(not isinstance(s, Emit) for s in leaving)

    def leaf(number: int) -> Block:
        done = (*stored, *arms.get(number, ()), *(leaving if whole else ())) if number else (
            *stored, *(decision.otherwise if whole else ()),
        )  # fmt: skip
        told: tuple[Stmt, ...] = () if whole or not number else (Let(local, _number(local, number)),)
        return (*told, *_chains(_with(done, local, number)))

    chain: Block = (*otherwise, *leaf(0))
    for link in reversed(links):
        if link.condition is None:
            chain = (*link.before, *leaf(link.number))
        else:
            chain = (*link.before, If(link.condition, (*link.then, *leaf(link.number)), chain))
    if whole:
        return (*chain, *_chains(rest[last + 1 :]))
    first = Let(local, _number(local, 0))
    after = If(decision.condition, _chains(tuple(leaving)), _chains(decision.otherwise))
    return (first, *chain, after, *_chains(rest[last + 1 :]))


def _number(local: Local, value: int) -> Const:
    return Const(value, local.type if isinstance(local.type, Int) else Int(value, value))


def _links(block: Sequence[Stmt], local: Local) -> tuple[list[_Link], Block] | None:
    """The decisions that give a local its number, one after another, and what comes where none does."""
    links: list[_Link] = []
    before: list[Stmt] = []
    left = list(block)
    while left:
        statement = left.pop(0)
        if isinstance(statement, Let) and statement.local == local:
            if not isinstance(statement.value, Const) or not statement.value.value:
                return None
            links.append(_Link(tuple(before), None, (), statement.value.value))
            return (links, ()) if all(_compares(s, "eq", local) for s in left) else None
        if not _mentions(statement, local):
            before.append(statement)
            continue
        if _compares(statement, "eq", local):  # nothing has given a number before
            assert isinstance(statement, If)
            if statement.otherwise:
                return None
            left = [*statement.then, *left]
            continue
        match statement:
            case If(condition, (*then, Let(given, Const(number, _))), ()) if given == local and number:
                if any(_mentions(s, local) for s in then) or not all(_compares(s, "eq", local) for s in left):
                    return None
                links.append(_Link(tuple(before), condition, tuple(then), number))
                before = []
            case _:
                return None
    return links, tuple(before)


def _stores(statement: Stmt, local: Local) -> bool:
    """Whether it only keeps the number."""
    return isinstance(statement, Set) and statement.index is None and statement.value == local


def _mentions(statement: Stmt, local: Local) -> bool:
    return any(
        (isinstance(s, Let) and s.local == local)
        or any(node == local for e in expressions(s) for node in distinct_nodes(e))
        for s in statements((statement,))
    )


def _with(block: Block, local: Local, number: int) -> Block:
    """The block with a number in the place of a local."""

    def expression(root: Expr) -> Expr:
        return rebuilt(root, lambda node: _number(local, number) if node == local else None)

    def statement(s: Stmt) -> Stmt:
        match s:
            case Set(var, index, value):
                return Set(var, None if index is None else expression(index), expression(value))
            case Let(given, value):
                return Let(given, expression(value))
            case If(condition, then, otherwise):
                return If(expression(condition), _with(then, local, number), _with(otherwise, local, number))
            case Switch(value, cases, default):
                made = tuple((key, _with(inner, local, number)) for key, inner in cases)
                return Switch(expression(value), made, _with(default, local, number))
            case Fault(fault, when):
                return Fault(fault, expression(when))
        return s

    return tuple(statement(s) for s in block)


# ---------------------------------------------------------------- guards


def _guards_in_place(block: Block) -> Block:
    """A local that only the next decision reads is written there, and what is told of it in the branch it opens."""
    uses = Counter(node.name for s in statements(block) for e in expressions(s) for node in _locals(e))
    given = Counter(s.local.name for s in statements(block) if isinstance(s, Let))

    def once(let: Stmt) -> bool:
        return isinstance(let, Let) and uses[let.local.name] == given[let.local.name] == 1

    def change(inner: Block) -> Block:
        out: list[Stmt] = []
        for s in inner:
            made = with_branches(s, change) if isinstance(s, If | Switch) else s
            before = len(out) - 1
            while before >= 0 and isinstance(out[before], Emit):
                before -= 1
            let = out[before] if before >= 0 else None
            if isinstance(made, If) and isinstance(made.condition, Local):
                made = If(made.condition, (*out[before + 1 :], *made.then), made.otherwise)
                del out[before + 1 :]
                if isinstance(let, Let) and made.condition == let.local and once(let):
                    made = If(let.value, made.then, made.otherwise)
                    del out[before]
            out.append(made)
        return tuple(out)

    return change(block)


def _locals(root: Expr) -> Iterator[Local]:
    """The locals of an expression; one that is the whole of it is read once."""
    return (node for node in distinct_nodes(root) if isinstance(node, Local))
