"""Loading and unloading machines, lowered (docs/semantics.md, Pools)."""

from __future__ import annotations

from llfsm_verify.program.program import BOOL, Block, Const, Expr, If, Set, Stmt, Var
from llfsm_verify.program.terms import FALSE, TRUE, conjunction, const, disjunction, get, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import pass_turn, process_var
from llfsm_verify.semantics.nesting import drop_inner
from llfsm_verify.semantics.queries import process_ended
from llfsm_verify.semantics.vocabulary import Control, emit


def load(context: Context, target: Control, asking: Control, *, suspended: bool, operator: bool = False) -> Block:
    """`load` and `load_suspended`: of a loaded machine that has not finished they do nothing. `operator`: the machine
    `asking` is only the first of the cycle."""
    if target is asking and not operator:
        return ()
    missing: list[Expr] = []
    if target.absents:
        missing.append(op("not", target.flag("loaded")))
    if target.var("finished") in context.variables:
        missing.append(target.flag("finished"))
    if not missing:
        return ()
    body: list[Stmt] = [emit(target, "load"), *_reset(context, target)]
    if target.absents:
        body.append(Set(target.var("loaded"), None, TRUE))
    accepting = process_var(context, target.process, "accepting")
    if accepting in context.variables:
        body.append(Set(accepting, None, FALSE))
    initial = target.machine.initial
    if suspended:
        assert target.suspend is not None
        body.append(emit(target, "suspend", const(initial), const(target.suspend)))
        if initial != target.suspend:
            body.append(Set(target.var("state"), None, const(target.suspend)))
            body.append(Set(target.var("previous"), None, const(initial + 1)))
    condition = disjunction(missing)
    if asking.process != target.process:
        condition = conjunction([op("not", process_ended(context, target.process)), condition])
    return (If(condition, tuple(body)),)


def unload(context: Context, target: Control, asking: Control) -> Block:
    """`unload`: the machine leaves without any action run. Of the machine that acts itself it waits for the end of the
    ringlet (`unload_self`)."""
    if target is asking:
        return (Set(target.var("unloads"), None, TRUE),)
    present: Expr = target.flag("loaded")
    body = _leave(context, target)
    if asking.process != target.process:
        present = conjunction([op("not", process_ended(context, target.process)), present])
        turn = process_var(context, target.process, "turn")
        here = op("eq", get(turn, context.variables[turn].type), const(target.position))
        body.append(If(here, tuple(pass_turn(context, target))))
    return (If(present, tuple(body)),)


def unload_self(context: Context, control: Control) -> Block:
    """Behind the ringlet of a machine that may have unloaded itself, or whose fault unloads it."""
    causes = [control.flag(what) for what in ("unloads", "faulted") if control.var(what) in context.variables]
    return (If(disjunction(list(causes)), tuple(_leave(context, control))),) if causes else ()


def _leave(context: Context, target: Control) -> list[Stmt]:
    return [
        emit(target, "unload"),
        *drop_inner(context, target),
        *_reset(context, target),
        Set(target.var("loaded"), None, FALSE),
    ]


def _reset(context: Context, target: Control) -> list[Stmt]:
    """Everything of the machine as it is at first, but whether it is loaded, and what it has sampled."""
    out: list[Stmt] = []
    for variable in context.variables.values():
        own = variable.origin.kind in ("machine", "state") or variable.name.startswith(target.var("seen."))
        if variable.origin.machine == target.machine.name and own:
            if isinstance(variable.init, tuple):
                out += [Set(variable.name, const(i), _start(variable, x)) for i, x in enumerate(variable.init)]
            else:
                out.append(Set(variable.name, None, _start(variable, variable.init)))
    initial = const(target.machine.initial)
    values: dict[str, Expr] = {"state": initial, "remembered": initial, "entered": FALSE, "finished": FALSE}
    values |= dict.fromkeys(("inside", "together", "done"), FALSE)
    for what, value in {**values, **dict.fromkeys(("pending", "previous", "clock", "age"), const(0))}.items():
        if target.var(what) in context.variables:
            out.append(Set(target.var(what), None, value))
    return out


def _start(variable: Var, value: int) -> Expr:
    return Const(value, BOOL) if variable.type == BOOL else const(value)
