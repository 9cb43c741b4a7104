"""Step programs without what nobody can see: for `--optimize size`.

Left out: control variables that nothing reads; faults that no step meets, where all steps can be explored, also those
after NAME_safe; and what follows a ringlet, where the turn decides it. What users have named keeps its values, in the
same steps.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from llfsm_verify.plug import (
    Block,
    Const,
    Expr,
    Fault,
    Get,
    If,
    Let,
    NativeProgram,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Value,
    blocks,
    expressions,
    nodes,
    rebuilt,
    statements,
    uses,
    without,
)

MOST_STEPS = 200_000
"""That are explored for faults."""


def smaller(program: Program, kept: Collection[str] = (), safe: Mapping[str, Value] = MappingProxyType({})) -> Program:
    """The program for an image. `kept`: variables that somebody else reads; `safe`: values that a caller can give
    outputs between steps. Faults that it cannot meet are not checked any more, and keep their numbers (`unchecked`)."""
    never = _never_met(program, safe)
    program = _changed(program, lambda block: without(block, lambda s: isinstance(s, Fault) and s.fault in never))
    program = _with_turns(program)
    while unread := _unread(program, kept):
        program = _changed(program, lambda block: without(block, lambda s: isinstance(s, Set) and s.var in unread))
        program = replace(program, vars=tuple(v for v in program.vars if v.name not in unread))
    return program


def unchecked(program: Program) -> frozenset[int]:
    """The faults for which it has no statement."""
    there = {s.fault for block, _ in blocks(program) for s in statements(block) if isinstance(s, Fault)}
    return frozenset(range(len(program.faults))) - there


def _never_met(program: Program, safe: Mapping[str, Value]) -> frozenset[int]:
    """The faults that no step meets from a configuration that steps, and a caller with safe values, can reach."""
    native = NativeProgram(program)
    if not program.faults or native.layout.initial_count() > MOST_STEPS:
        return frozenset()
    read = {name for block, _ in blocks(program) for name in _read(block)}
    changes = {name: value for name, value in safe.items() if name in read}
    todo, seen, met, count = list[bytes](), set[bytes](), set[int](), 0

    def reach(record: bytes) -> None:
        if record in seen:
            return
        seen.add(record)
        todo.append(record)
        if changes:
            reach(native.layout.encode_record({**native.layout.decode_record(record), **changes}))

    for record in native.layout.initial_records():
        reach(record)
    while todo:
        data, number = b"".join(todo), len(todo)
        todo.clear()
        for edge in native.edges(data, number):
            count += 1
            if count > MOST_STEPS:
                return frozenset()
            if edge.status:
                met.add(edge.status - 1)
            else:
                reach(edge.record)
    return frozenset(range(len(program.faults))) - met


def _changed(program: Program, change: Callable[[Block], Block]) -> Program:
    slots = tuple(
        replace(
            s, prologue=change(s.prologue), blocks=tuple(map(change, s.blocks)), epilogue=change(s.epilogue),
            canonical=change(s.canonical),
        )
        for s in program.slots
    )  # fmt: skip
    processes = tuple(replace(p, epilogue=change(p.epilogue)) for p in program.processes)
    return replace(program, slots=slots, processes=processes, letter=change(program.letter))


def _with_turns(program: Program) -> Program:
    """What follows a ringlet stands in the slots, with the values that the slot has just stored, if that is shorter."""
    (process,) = program.processes

    def of(slot: Slot) -> Slot:
        known: dict[str, Expr] = {s.var: s.value for s in slot.epilogue if isinstance(s, Set)}
        simple = all(isinstance(s, Set) and s.index is None and isinstance(s.value, Const) for s in slot.epilogue)
        return replace(slot, epilogue=slot.epilogue + _known(process.epilogue, known if simple else {}))

    slots = tuple(map(of, program.slots))
    added = sum(_size(new.epilogue) - _size(old.epilogue) for new, old in zip(slots, program.slots, strict=True))
    clash = any(_locals(slot.epilogue) & _locals(process.epilogue) for slot in program.slots)
    if clash or added > _size(process.epilogue) + len(slots):
        return program
    return replace(program, slots=slots, processes=(replace(process, epilogue=()),))


def _size(block: Block) -> int:
    return sum(1 for _ in statements(block))


def _locals(block: Block) -> set[str]:
    return {s.local.name for s in statements(block) if isinstance(s, Let | Sample)}


def _known(block: Block, known: dict[str, Expr]) -> Block:
    """The block where these variables have these values, until it stores others."""
    made: list[Stmt] = []
    for s in block:
        stored = {inner.var for inner in statements((s,)) if isinstance(inner, Set)}
        if isinstance(s, If):
            condition = _filled(s.condition, known)
            if isinstance(condition, Const):
                made += _known(s.then if condition.value else s.otherwise, known)
            else:
                made.append(If(condition, _known(s.then, known), _known(s.otherwise, known)))
        elif isinstance(s, Set | Let):
            made.append(replace(s, value=_filled(s.value, known)))
        else:
            made.append(s)
        known = {name: value for name, value in known.items() if name not in stored}
    return tuple(made)


def _filled(root: Expr, known: dict[str, Expr]) -> Expr:
    return rebuilt(root, lambda e: known.get(e.var) if isinstance(e, Get) and e.index is None else None)


def stores_cycle(program: Program) -> bool:
    """Whether each slot stores the output `cycle`, and nothing reads it before: it needs no reset."""
    stored = all(any(isinstance(s, Set) and s.var == program.cycle for s in slot.epilogue) for slot in program.slots)
    before = (block for slot in program.slots for block in (slot.prologue, *slot.blocks))
    return stored and not any(program.cycle in _read(block) for block in before)


def _read(block: Block) -> Iterator[str]:
    for statement in statements(block):
        for root in expressions(statement):
            yield from (e.var for e in nodes(root) if isinstance(e, Get))


def _unread(program: Program, kept: Collection[str]) -> set[str]:
    """Control variables and outputs of which nothing depends."""
    needed = {program.cycle, *kept, *(a.output for a in program.atoms), *(s.state for s in program.slots)}
    needed |= {name for p in program.processes for name in (p.turn, p.ended) if name is not None}
    needed |= {name for f in program.fairness for name in (f.premise, f.goal) if name is not None}
    needed |= {name for block, _ in blocks(program) for name in _read(block)}
    risky = {s.var for block, _ in blocks(program) for s in statements(block)
             if isinstance(s, Set) and any(uses(e).fails for e in expressions(s))}  # fmt: skip
    return {v.name for v in program.vars if v.origin.kind in ("control", "output") and v.name not in needed | risky}
