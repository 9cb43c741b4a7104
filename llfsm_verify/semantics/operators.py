"""What operators may do, lowered: choices where a cycle begins (docs/semantics.md, Operators)."""

from __future__ import annotations

from llfsm_verify.language.types import ArrayType, RecordType
from llfsm_verify.program.program import BOOL, Block, If, Int, Local, Sample, Set, Stmt
from llfsm_verify.program.terms import const, op
from llfsm_verify.semantics.commands import command, send, take_command, take_inner
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.storage import labels, machine_type
from llfsm_verify.semantics.vocabulary import ENTER, Control

OPERATOR = "operator."
"""What the names of choices begin with that stand for what operators do."""
ARGUMENTS = {"write": "value", "enter": "state"}
"""By the kind of what they do: the choice that says what is written, or entered."""


def is_command(choice: str) -> bool:
    """Whether a choice of this name is that something comes from an operator."""
    kind, _, target = choice.removeprefix(OPERATOR).partition("(")
    return choice.startswith(OPERATOR) and bool(target) and kind not in ARGUMENTS.values()


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
    effect: Block
    if operator.kind == "enter":
        names = tuple(state.name for state in target.machine.states)
        kind = Int(0, len(names) - 1)
        state = Local(f"operator.{number}.state", kind)
        choice = context.operator_choice(f"{OPERATOR}state({operator.target})", kind, names)
        effect = (Sample(state, choice), *send(context, control, op("add", state, const(ENTER)), operator.target))
    else:
        effect = command(context, control, operator.kind, operator.target, operator=True)
    if context.arrangement.profile.commands != "end_of_ringlet":
        return effect
    own = take_command(context, target) if target.pending else []
    return (*effect, *own, *take_inner(context, operator.target))
