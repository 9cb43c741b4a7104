"""Commands between machines, lowered (docs/semantics.md, Commands)."""

from __future__ import annotations

from llfsm_verify.program.program import Block, If, Int, Set, Stmt, Switch
from llfsm_verify.program.terms import FALSE, const, get, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.loading import load, unload
from llfsm_verify.semantics.nesting import drop_inner, set_inner_aside
from llfsm_verify.semantics.sending import send
from llfsm_verify.semantics.vocabulary import COMMANDS, RESTART, RESUME, SUSPEND, Control, emit


def command(context: Context, asking: Control, kind: str, machine: str, *, operator: bool = False) -> Block:
    """Load or unload, or put a command into the target's pending slot. `asking`: whose ringlet it is, or begins where
    an operator gives the command."""
    target = context.control(machine)
    if kind == "unload":
        return unload(context, target, asking)
    if kind in ("load", "load_suspended"):
        return load(context, target, asking, suspended=kind == "load_suspended", operator=operator)
    return send(context, asking, COMMANDS[kind], machine)


def take_command(context: Context, control: Control) -> list[Stmt]:
    """The pending command takes effect: the state changes here, the actions it calls for run in the state's block."""
    pending = control.var("pending")
    cases = ((SUSPEND, _suspend(context, control)), (RESUME, _resume(control)), (RESTART, _restart(context, control)))
    return [
        If(
            op("ne", get(pending, Int(0, 3)), const(0)),
            (Switch(get(pending, Int(0, 3)), tuple((k, b) for k, b in cases if b)), Set(pending, None, const(0))),
        )
    ]


def _suspend(context: Context, control: Control) -> Block:
    if control.suspend is None:
        return ()
    suspend, state = const(control.suspend), control.state
    body: list[Stmt] = [emit(control, "suspend", state, suspend), *set_inner_aside(context, control)]
    if control.remembered:
        body.append(Set(control.var("remembered"), None, state))
    if control.previous:
        body.append(Set(control.var("previous"), None, op("add", state, const(1))))
    body += [Set(control.var("entered"), None, FALSE), Set(control.var("state"), None, suspend)]
    body += _revive(context, control)
    again = emit(control, "suspend", suspend, suspend)
    return (If(op("eq", state, suspend), (again,), tuple(body)),)


def _revive(context: Context, control: Control) -> list[Stmt]:
    """Under `finished: keep` a command that moves a machine takes its being finished away."""
    name = control.var("finished")
    return [Set(name, None, FALSE)] if name in context.variables and control.keeps else []


def _resume(control: Control) -> Block:
    if control.suspend is None or not control.remembered:
        return ()
    target = get(control.var("remembered"), control.state.type)
    body: list[Stmt] = [emit(control, "resume", control.state, target)]
    if control.previous:
        body.append(Set(control.var("previous"), None, const(control.suspend + 1)))
    body += [Set(control.var("entered"), None, FALSE), Set(control.var("state"), None, target)]
    return (If(op("eq", control.state, const(control.suspend)), tuple(body)),)


def _restart(context: Context, control: Control) -> Block:
    initial = const(control.machine.initial)
    body: list[Stmt] = drop_inner(context, control)
    body += [Set(control.var("entered"), None, FALSE), Set(control.var("state"), None, initial)]
    if control.previous:
        body.append(Set(control.var("previous"), None, const(0)))
    announce = emit(control, "restart", control.state)
    revive = _revive(context, control)
    if context.arrangement.profile.restart_enters_initial:
        return (announce, *revive, *body)
    return (announce, *revive, If(op("ne", control.state, initial), tuple(body)))
