"""Pending slots: a command waits there for its target's turn (docs/semantics.md, Commands)."""

from __future__ import annotations

from llfsm_verify.program.program import Block, Get, If, Int, Set
from llfsm_verify.program.terms import TRUE, const, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.queries import in_schedule
from llfsm_verify.semantics.vocabulary import RESTART, RESUME, Control


def send(context: Context, asking: Control, command: int, machine: str) -> Block:
    """Put `command` into the pending slot of a machine that is there: the last one wins, but a resume never replaces a
    restart. `asking`: whose ringlet it is."""
    target = context.control(machine)
    pending = Get(target.var("pending"), None, Int(0, 3))
    effect: Block = (Set(target.var("pending"), None, const(command)),)
    if command == RESUME:
        effect = (If(op("ne", pending, const(RESTART)), effect),)
    there = in_schedule(context, target, asking)
    return effect if there == TRUE else (If(there, effect),)
