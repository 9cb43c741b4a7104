"""Machines inside states, lowered (docs/semantics.md, Machines inside states): other words for commands."""

from __future__ import annotations

from llfsm_verify.program.program import Block, If, Int, Set, Stmt, Switch
from llfsm_verify.program.terms import FALSE, TRUE, const, disjunction, get, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.sending import send
from llfsm_verify.semantics.vocabulary import RESTART, RESUME, SUSPEND, Control


def run_inner(context: Context, control: Control, index: int) -> list[Stmt]:
    """Behind `on_entry`: the machines of the state begin anew, or go on where they were suspended with their owner."""
    runs = control.runs(index)
    if not runs:
        return []
    anew: list[Stmt] = []
    on: list[Stmt] = []
    for name in runs:
        target = context.control(name)
        anew += send(context, control, RESTART, name)
        if target.var("done") in context.variables:
            anew.append(Set(target.var("done"), None, FALSE))
        if target.var("together") in context.variables:
            forget = Set(target.var("together"), None, FALSE)
            anew.append(forget)
            on.append(If(target.flag("together"), (*send(context, control, RESUME, name), forget)))
    if control.var("inside") not in context.variables:
        return anew
    on.append(Set(control.var("inside"), None, FALSE))
    return [If(control.flag("inside"), tuple(on), tuple(anew))]


def suspend_inner(context: Context, control: Control, index: int) -> list[Stmt]:
    """Before `on_exit` of a state that is left: its machines are suspended."""
    return [s for name in control.runs(index) for s in send(context, control, SUSPEND, name)]


def drop_inner(context: Context, control: Control) -> list[Stmt]:
    """Before a restart or an unload of an owner: the machines of the state that it is in are suspended."""
    out = _by_state(control, [tuple(suspend_inner(context, control, i)) for i in range(len(control.states))])
    return [*out, *forget_inner(context, control)]


def forget_inner(context: Context, control: Control) -> list[Stmt]:
    """The owner will not go on where it was: which machines were suspended with it does not matter any more."""
    names = [control.var("inside"), *(context.control(m).var("together") for m in control.owned)]
    return [Set(name, None, FALSE) for name in names if name in context.variables]


def set_inner_aside(context: Context, control: Control) -> list[Stmt]:
    """Before a suspend command moves an owner: the machines that run in its state are suspended with it."""
    if control.var("inside") not in context.variables:
        return []
    blocks: list[Block] = []
    for index in range(len(control.states)):
        body: list[Stmt] = []
        for name in control.runs(index):
            target = context.control(name)
            assert target.suspend is not None
            waits = get(target.var("pending"), Int(0, 3))
            runs = op("and", op("ne", target.state, const(target.suspend)), op("ne", waits, const(SUSPEND)))
            will = [op("eq", waits, const(RESTART)), op("eq", waits, const(RESUME))]
            body.append(
                If(
                    disjunction([runs, *will]),
                    (Set(target.var("together"), None, TRUE), *send(context, control, SUSPEND, name)),
                )
            )
        if body:
            body.append(Set(control.var("inside"), None, control.flag("entered")))
        blocks.append(tuple(body))
    return [*forget_inner(context, control), *_by_state(control, blocks)]


def _by_state(control: Control, blocks: list[Block]) -> list[Stmt]:
    cases = tuple((i, block) for i, block in enumerate(blocks) if block)
    return [Switch(control.state, cases)] if cases else []
