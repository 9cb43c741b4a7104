"""Choices with fewer values: every run of what is made is one of the program, and others are left out.

A choice then gives the place of its value among those that are left. Only samples in prologues are changed, which are
those of inputs that are held for a cycle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from llfsm_verify.program.program import Block, Const, If, Int, Let, Local, Program, Sample, Stmt, Switch
from llfsm_verify.program.terms import found
from llfsm_verify.program.trees import with_branches

PLACE = "$place."


def narrowed(program: Program, values: Mapping[str, tuple[int, ...]]) -> Program:
    """The program in which each of these choices has these values, at least one."""

    def block(given: Block) -> Block:
        return tuple(s for statement in given for s in changed(statement))

    def changed(statement: Stmt) -> Block:
        if isinstance(statement, If | Switch):
            return (with_branches(statement, block),)
        if not isinstance(statement, Sample) or statement.choice not in values:
            return (statement,)
        left, local = values[statement.choice], statement.local
        place = Local(f"{PLACE}{local.name}", Int(0, len(left) - 1))
        value = found(place, [Const(number, local.type) for number in left])
        return Sample(place, statement.choice), Let(local, value)

    return replace(
        program,
        choices=tuple(
            replace(c, type=Int(0, len(values[c.name]) - 1), labels=()) if c.name in values else c
            for c in program.choices
        ),
        slots=tuple(replace(slot, prologue=block(slot.prologue)) for slot in program.slots),
    )
