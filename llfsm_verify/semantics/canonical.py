"""Control variables that can no longer matter get one fixed value: the only place where states are reduced."""

from __future__ import annotations

from llfsm_verify.program.program import Block, Expr, If, Int, Set, Stmt, Switch
from llfsm_verify.program.terms import TRUE, const, get, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.declaring import with_init
from llfsm_verify.semantics.vocabulary import Control


def canonical_block(context: Context, machines: list[str]) -> Block:
    """The statements that make the control variables of `machines` canonical."""
    return tuple(s for name in machines for s in _machine(context, context.control(name)))


def _machine(context: Context, control: Control) -> list[Stmt]:
    out: list[Stmt] = []
    if control.previous:
        out += _forget_previous(control)
    if control.machine.name not in context.entered:
        out += _skip_empty_entries(control)
    out += _stop_clock(context, control)
    if control.remembered and not _suspended_otherwise(control):
        assert control.suspend is not None
        forget = Set(control.var("remembered"), None, const(control.machine.initial))
        out.append(If(op("ne", control.state, const(control.suspend)), (forget,)))
    if control.var("finished") in context.variables and not control.keeps:
        out.append(If(control.flag("finished"), tuple(_rest(context, control))))
    return out


def _suspended_otherwise(control: Control) -> bool:
    """The suspend state can become current without a suspend command: by a transition, a restart or `enter`."""
    return (
        control.suspend == control.machine.initial
        or (control.enters and control.machine.suspend is not None)
        or any(
            t.target == control.suspend
            for i, s in enumerate(control.states)
            for t in s.transitions
            if i != control.suspend
        )
    )


def _forget_previous(control: Control) -> list[Stmt]:
    """The state left matters only while an on_suspend or on_resume with text is due."""
    previous = get(control.var("previous"), Int(0, len(control.states)))
    suspend = control.suspend
    assert suspend is not None
    forget: Block = (Set(control.var("previous"), None, const(0)),)
    silent = [i for i, s in enumerate(control.states) if not s.on_suspend]
    # Coming from the suspend state into itself (it is the initial one too) nothing is due.
    on_suspend = Switch(previous, tuple((i + 1, forget) for i in sorted({*silent, suspend})))
    cases: list[tuple[int, Block]] = [(suspend, (on_suspend,))]
    if not control.states[suspend].on_resume:
        cases += [(i, forget) for i, s in enumerate(control.states) if i != suspend and not s.on_resume]
    return [If(op("ne", previous, const(0)), (Switch(control.state, tuple(cases)),))]


def _trivial_entry(control: Control, state: int) -> bool:
    return not (control.states[state].on_entry or control.watches_clock(state) or control.runs(state))


def _skip_empty_entries(control: Control) -> list[Stmt]:
    """A state whose entry does nothing counts as entered."""
    enter: Block = (Set(control.var("entered"), None, TRUE),)
    cases = tuple((i, enter) for i in range(len(control.states)) if _trivial_entry(control, i))
    if not cases:
        return []
    missing: Expr = op("not", control.flag("entered"))
    if control.previous:
        missing = op("and", missing, op("eq", get(control.var("previous"), Int(0, len(control.states))), const(0)))
    return [If(missing, (Switch(control.state, cases),))]


def _stop_clock(context: Context, control: Control) -> list[Stmt]:
    """A clock that is about to restart, or that the state does not read, is 0."""
    if control.due_reads_clock:
        return []
    out: list[Stmt] = []
    for what in ("clock", "age"):
        name = control.var(what)
        if name in context.variables:
            stop: Block = (Set(name, None, const(0)),)
            idle = tuple((i, stop) for i in range(len(control.states)) if not control.watches_clock(i))
            out.append(If(op("not", control.flag("entered")), stop, (Switch(control.state, idle),)))
    return out


def _rest(context: Context, control: Control) -> list[Stmt]:
    """A machine that has left the schedule keeps its state and its variables only."""
    fixed: list[tuple[str, Expr]] = [("entered", TRUE)]
    for what in ("previous", "clock", "age", "pending"):
        name = control.var(what)
        if name in context.variables and not context.variables[name].output:
            fixed.append((what, const(0)))
    if control.remembered:
        fixed.append(("remembered", const(control.machine.initial)))
    return [Set(control.var(what), None, value) for what, value in fixed]


def canonical_start(context: Context) -> None:
    """The initial configuration, made canonical: machines start unentered, so only this flag can change."""
    for control in context.every_control:
        due = control.machine.suspended and bool(control.states[control.machine.initial].on_suspend)
        if control.machine.suspended and not due:
            with_init(context, control.var("previous"), 0)
        start = control.suspend if control.machine.suspended else control.machine.initial
        assert start is not None
        if _trivial_entry(control, start) and not due and control.machine.name not in context.entered:
            with_init(context, control.var("entered"), 1)
