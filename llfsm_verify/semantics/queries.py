"""Questions about machines, lowered: where a machine is, and whether it still takes part."""

from __future__ import annotations

from llfsm_verify.program.program import BOOL, Expr, Get
from llfsm_verify.program.terms import FALSE, const, disjunction, op
from llfsm_verify.semantics.context import Context, Control


def in_schedule(context: Context, target: Control, asking: Control | None = None) -> Expr:
    """The machine has not left the schedule, nor has its process ended."""
    gone: list[Expr] = []
    if context.arrangement.finished == "leave" and target.leaves:
        gone.append(target.flag("finished"))
    if asking is None or asking.process != target.process:
        ended = f"{context.arrangement.processes[target.process].name}.$ended"
        if ended in context.variables:
            gone.append(Get(ended, None, BOOL))
    return op("not", disjunction(gone))


def at_state(context: Context, machine: str, state: int) -> Expr:
    control = context.control(machine)
    if state < 0:
        if control.machine.suspend is not None or control.suspend is None:
            return FALSE
        state = control.suspend
    return op("eq", control.state, const(state))


def query(context: Context, kind: str, machine: str) -> Expr:
    """`is_suspended`, `is_running`: the machine as it is, not its pending slot."""
    control = context.control(machine)
    suspended = FALSE if control.suspend is None else op("eq", control.state, const(control.suspend))
    if kind == "suspended":
        return suspended
    return op("and", in_schedule(context, control), op("not", suspended))
