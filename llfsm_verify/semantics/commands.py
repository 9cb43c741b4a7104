"""Commands between machines, lowered (docs/semantics.md: Commands, Pools, Machines inside states).

A pending slot holds a command until its target's turn. Loading acts at once. Machines inside states get commands with
their state.
"""

from __future__ import annotations

from llfsm_verify.program.program import BOOL, Block, Const, Emit, Expr, If, Set, Stmt, Switch, Var
from llfsm_verify.program.terms import FALSE, TRUE, conjunction, const, disjunction, get, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import pass_turn, process_var
from llfsm_verify.semantics.queries import in_schedule, process_ended
from llfsm_verify.semantics.vocabulary import COMMANDS, ENTER, RESTART, RESUME, SUSPEND, Control, emit


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
    initial = control.machine.initial
    cases = [
        (SUSPEND, _suspend(context, control)),
        (RESUME, _resume(control)),
        (RESTART, _begin_in(context, control, initial, emit(control, "restart", control.state))),
    ]
    for number in range(len(control.machine.states)) if control.enters else ():
        announce = emit(control, "enter", control.state, const(number))
        cases.append((ENTER + number, _begin_in(context, control, number, announce)))
    taken = Switch(control.waiting, tuple((k, b) for k, b in cases if b))
    return [If(op("ne", control.waiting, const(0)), (taken, Set(control.var("pending"), None, const(0))))]


def take_inner(context: Context, owner: str) -> list[Stmt]:
    """What was commanded to the machines inside an owner takes effect where they are not asked for it otherwise."""
    return [s for name in context.inside(owner) for s in take_command(context, context.control(name))]


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


def _begin_in(context: Context, control: Control, number: int, announce: Emit) -> Block:
    """The machine is in that state as it is at first in the initial one, with its variables as they are."""
    state = const(number)
    body: list[Stmt] = drop_inner(context, control)
    body += [Set(control.var("entered"), None, FALSE), Set(control.var("state"), None, state)]
    if control.previous:
        body.append(Set(control.var("previous"), None, const(0)))
    revive = _revive(context, control)
    if context.arrangement.profile.restart_enters_initial:
        return (announce, *revive, *body)
    return (announce, *revive, If(op("ne", control.state, state), tuple(body)))


def send(context: Context, asking: Control, command: int | Expr, machine: str) -> Block:
    """Put `command` into the pending slot of a machine that is there: the last one wins, but a resume never replaces a
    restart or `enter`. `asking`: whose ringlet it is."""
    target = context.control(machine)
    value = const(command) if isinstance(command, int) else command
    effect: Block = (Set(target.var("pending"), None, value),)
    if command == RESUME:
        effect = (If(op("lt" if target.enters else "ne", target.waiting, const(RESTART)), effect),)
    there = in_schedule(context, target, asking)
    return effect if there == TRUE else (If(there, effect),)


def run_inner(context: Context, control: Control, index: int) -> list[Stmt]:
    """After `on_entry`: the machines of the state begin again, or go on where they were suspended with their owner."""
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
            waits = target.waiting
            runs = op("and", op("ne", target.state, const(target.suspend)), op("ne", waits, const(SUSPEND)))
            will = [op("ge" if target.enters else "eq", waits, const(RESTART)), op("eq", waits, const(RESUME))]
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
    """After the ringlet of a machine that may have unloaded itself, or whose fault unloads it."""
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
