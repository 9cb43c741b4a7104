"""Questions about machines, lowered: where a machine is, and whether it still takes part."""

from __future__ import annotations

from llfsm_verify.program.program import BOOL, Expr, Get
from llfsm_verify.program.terms import FALSE, const, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import in_turn, process_var
from llfsm_verify.semantics.vocabulary import Control


def in_schedule(context: Context, target: Control, asking: Control | None = None) -> Expr:
    """The machine takes turns, and its process has not ended, as that of `asking` has not."""
    if asking is not None and asking.process == target.process:
        return in_turn(target)
    return op("and", in_turn(target), op("not", process_ended(context, target.process)))


def process_ended(context: Context, process: int) -> Expr:
    """The process has ended."""
    name = process_var(context, process, "ended")
    return Get(name, None, BOOL) if name in context.variables else FALSE


def while_loaded(control: Control, value: Expr) -> Expr:
    """`value`, and false while the machine is not loaded."""
    return op("and", control.flag("loaded"), value) if control.absents else value


def at_state(context: Context, machine: str, state: int) -> Expr:
    control = context.control(machine)
    if state < 0:
        if control.machine.suspend is not None or control.suspend is None:
            return FALSE
        state = control.suspend
    return while_loaded(control, op("eq", control.state, const(state)))


def query(context: Context, kind: str, machine: str) -> Expr:
    """`is_suspended`, `is_running`: the machine as it is, not its pending slot."""
    control = context.control(machine)
    if kind == "done":
        return control.flag("done")
    suspended = FALSE if control.suspend is None else op("eq", control.state, const(control.suspend))
    if kind == "suspended":
        return while_loaded(control, suspended)
    return op("and", in_schedule(context, control), op("not", suspended))
