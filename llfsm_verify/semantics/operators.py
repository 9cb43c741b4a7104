"""What operators may do, lowered: choices where a cycle begins (docs/semantics.md, Operators)."""

from __future__ import annotations

from llfsm_verify.language.types import ArrayType, RecordType
from llfsm_verify.program.program import BOOL, Block, If, Int, Local, Sample, Set, Stmt
from llfsm_verify.semantics.commands import command, take_command
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.storage import labels, machine_type
from llfsm_verify.semantics.vocabulary import COMMANDS, Control

OPERATOR = "operator."
"""What the names of choices begin with that stand for what operators do."""


def operate(context: Context, control: Control) -> list[Stmt]:
    """Before the ringlet of `control`, the first of a cycle: each command and each write may come."""
    out: list[Stmt] = []
    for number, operator in enumerate(context.arrangement.operators):
        name = f"{OPERATOR}{operator.kind}({operator.target})"
        comes = Local(f"operator.{number}", BOOL)
        out.append(Sample(comes, context.operator_choice(name, BOOL)))
        out.append(If(comes, _effect(context, control, number)))
    return out


def _effect(context: Context, control: Control, number: int) -> Block:
    operator = context.arrangement.operators[number]
    if operator.kind == "write":
        entry = next(w.variable for w in context.arrangement.whiteboard if w.variable.name == operator.target)
        assert not isinstance(entry.type, ArrayType | RecordType), "the loader refuses what has parts"
        kind = machine_type(entry.type)
        assert isinstance(kind, Int), "the loader refuses integers without a range"
        value = Local(f"operator.{number}.value", kind)
        choice = context.operator_choice(f"operator.value({operator.target})", kind, labels(entry.type))
        return (Sample(value, choice), Set(entry.name, None, value))
    target = context.control(operator.target)
    effect = command(context, control, operator.kind, operator.target, operator=True)
    if operator.kind in COMMANDS and context.arrangement.profile.commands == "end_of_ringlet":
        return (*effect, *take_command(context, target))
    return effect
