"""Between ringlets: whose turn is next, when a cycle is complete, how clocks advance, when a process ends."""

from __future__ import annotations

from llfsm_verify.program.program import BOOL, Block, Expr, Get, If, Int, Process, Set, Stmt, Switch
from llfsm_verify.program.terms import TRUE, conjunction, const, disjunction, get, ite, op
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.vocabulary import CYCLE, Control


def process_var(context: Context, process: int, what: str) -> str:
    return f"{context.arrangement.processes[process].name}.${what}"


def declare_processes(context: Context) -> None:
    """The variables of each process; `ended` and `accepting` exist where every machine could accept in one cycle."""
    controls = list(context.controls.values())
    for index, process in enumerate(context.arrangement.processes):
        members = [c for c in controls if c.process == index]
        names = tuple(process.schedule)
        context.control_var(process_var(context, index, "turn"), Int(0, len(names) - 1), 0, "", names)
        told = context.arrangement.profile.snapshot == "cycle" and context.samples.readers
        begun = bool(context.plants) or any(s.stored and s.choice for s in context.inputs.values())
        if told or begun or context.arrangement.operators:
            context.control_var(process_var(context, index, "begins"), BOOL, 1)
        if all(c.absents or any(s.finishes for s in c.states) for c in members):
            context.control_var(process_var(context, index, "accepting"), BOOL, 1)
            context.control_var(process_var(context, index, "ended"), BOOL, 0)


def in_turn(control: Control) -> Expr:
    """The machine takes turns: it is loaded, and has not left the schedule."""
    stays: Expr = TRUE
    if not control.keeps and control.leaves:
        stays = op("not", control.flag("finished"))
    return op("and", control.flag("loaded"), stays) if control.absents else stays


def _members(context: Context, process: int) -> list[Control]:
    return sorted((c for c in context.controls.values() if c.process == process), key=lambda c: c.position)


def may_begin(context: Context, control: Control) -> bool:
    """Whether the machine can be the first of a cycle: those before it leave the schedule."""
    return all(in_turn(c) != TRUE for c in _members(context, control.process)[: control.position])


def next_turn(context: Context, control: Control) -> list[Stmt]:
    """The token passes to the next live machine; after the last one the cycle is complete."""
    complete, following = _following(context, control)
    turn = process_var(context, control.process, "turn")
    return [Set(CYCLE, None, complete), Set(turn, None, following)]


def pass_turn(context: Context, control: Control) -> list[Stmt]:
    """The token passes on without a step, since the machine whose turn it is has been unloaded by another process."""
    complete, following = _following(context, control)
    turn = process_var(context, control.process, "turn")
    return [If(complete, tuple(_end_cycle(context, control.process))), Set(turn, None, following)]


def _following(context: Context, control: Control) -> tuple[Expr, Expr]:
    """Whether the machine is the last live one of its cycle, and the position of the next one."""
    members = _members(context, control.process)
    later = members[control.position + 1 :]
    complete = conjunction([op("not", in_turn(c)) for c in later])
    return complete, _first([*later, *members])


def _first(members: list[Control]) -> Expr:
    """The position of the first live machine of `members` (of the last one when none is)."""
    position: Expr = const(members[-1].position)
    for control in reversed(members[:-1]):
        position = ite(in_turn(control), const(control.position), position)
    return position


def lower_process(context: Context, index: int, slots: tuple[int, ...]) -> Process:
    """The process and what happens when it has completed a cycle."""
    body = _end_cycle(context, index)
    ended = process_var(context, index, "ended")
    epilogue: Block = (If(get(CYCLE, BOOL), tuple(body)),) if body else ()
    name = context.arrangement.processes[index].name
    exists = ended in context.variables
    return Process(name, slots, process_var(context, index, "turn"), ended if exists else None, epilogue)


def _end_cycle(context: Context, index: int) -> list[Stmt]:
    """A cycle of the process is complete: its clocks go on, it may have ended, and another cycle begins."""
    body: list[Stmt] = []
    for control in (*_members(context, index), *context.plants.values()):
        body += _tick(context, control)
    ended, accepting = process_var(context, index, "ended"), process_var(context, index, "accepting")
    if ended in context.variables:
        over: Expr = get(accepting, BOOL)
        members = _members(context, index)
        if any(c.absents for c in members):
            over = disjunction([over, conjunction([op("not", in_turn(c)) for c in members])])
        body += [Set(ended, None, over), Set(accepting, None, TRUE)]
    begins = process_var(context, index, "begins")
    if begins in context.variables:
        body.append(Set(begins, None, TRUE))
    return body


def _tick(context: Context, control: Control) -> list[Stmt]:
    """One cycle passes on the machine's clock, which stops at the largest tick its state tells apart."""
    clock = control.var("clock")
    if clock not in context.variables:
        return []
    value: Get = get(clock, context.variables[clock].type)
    advance: Block = (Set(clock, None, op("min", op("add", value, const(1)), const(max(control.caps)))),)
    cases: dict[int, list[int]] = {}
    for state, cap in enumerate(control.caps):
        if cap:
            cases.setdefault(cap, []).append(state)
    arms = []
    for cap, states in cases.items():
        step: Block = (If(op("lt", value, const(cap)), advance),)
        arms += [(state, step) for state in states]
    counts: Block = (Switch(control.state, tuple(arms)),)
    if not control.due_reads_clock:
        counts = (If(control.flag("entered"), counts),)
    live = in_turn(control)  # nothing reads the clock of a machine that has left
    return list(counts) if live == TRUE else [If(live, counts)]
