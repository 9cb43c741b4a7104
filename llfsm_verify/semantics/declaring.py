"""Which variables and choices a step program has: those of the text, and of each machine what can happen to it."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.arrangement.model import Machine, State
from llfsm_verify.language.scope import IMPLICIT_SUSPEND
from llfsm_verify.language.typed import Variable
from llfsm_verify.program.program import BOOL, Choice, Input, Int, MachineInfo, Origin, TransitionInfo, Type, Var
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.storage import element_names, element_values, labels, leaf_values, leaves, machine_type
from llfsm_verify.semantics.vocabulary import COMMANDS, Control, InputScalar
from llfsm_verify.semantics.walk import Survey, survey


def declare(context: Context) -> None:
    """Declare every variable and choice that the arrangement's text calls for."""
    arrangement = context.arrangement
    stored_by_profile = arrangement.profile.snapshot == "cycle"
    for entry in arrangement.whiteboard:
        if entry.role != "input":
            declare_variable(context, entry.variable)
            continue
        pairs = zip(
            element_names(entry.variable.name, entry.variable.type),
            element_values(entry.variable.type, entry.variable.init),
            strict=True,
        )
        for (name, scalar), init in pairs:
            kind = machine_type(scalar)
            assert isinstance(kind, Int), "the loader refuses inputs of type int"
            stored = stored_by_profile or entry.changes != "step" or entry.driven
            sampled = entry.changes != "never" and not entry.driven
            context.inputs[name] = InputScalar(
                name, kind, labels(scalar), stored, name if sampled else "", init, entry.variable.name, entry.driven
            )
            if sampled:
                context.choices[name] = Choice(name, kind, "input", name, labels(scalar))
            if stored:
                context.add(Var(name, kind, init, Origin("input", "", labels(scalar)), free=entry.free))
    for machine in arrangement.texts:
        for variable in machine.variables:
            declare_variable(context, variable, machine.name)
        for state in machine.states:
            for variable in state.variables:
                declare_variable(context, variable, machine.name)


def declare_variable(context: Context, variable: Variable, machine: str = "") -> None:
    for leaf, init in zip(leaves(variable.type), leaf_values(variable.type, variable.init), strict=True):
        pattern = variable.name + leaf.pattern if leaf.dimensions else ""
        origin = Origin(variable.scope, machine, labels(leaf.type), pattern, leaf.dimensions)
        context.add(Var(variable.name + leaf.suffix, machine_type(leaf.type), init, origin, leaf.length))


def unstored_inputs(context: Context) -> tuple[Input, ...]:
    scalars = [s for s in context.inputs.values() if not s.stored]
    return tuple(Input(s.name, s.type, s.init, s.labels) for s in scalars)


# -------------------------------------------------- control variables


def declare_controls(context: Context, wants_finished: frozenset[str]) -> None:
    """Find out what can happen to each machine and declare its control variables.

    `wants_finished`: machines whose `finished` a property asks for (under `finished: keep` nothing else needs it).
    """
    arrangement = context.arrangement
    received: dict[str, set[str]] = {m.name: set() for m in arrangement.machines}
    surveys: dict[str, list[tuple[Survey, Survey]]] = {}
    for machine in arrangement.machines:
        surveys[machine.name] = [_surveys(s) for s in machine.states]
        given = [c for parts in surveys[machine.name] for part in parts for c in part.commands]
        for command in given:
            received[command.machine].add(command.kind)
        context.commanded[machine.name] = frozenset(c.machine for c in given)
    operated = [o for o in arrangement.operators if o.kind != "write"]
    for operator in operated:
        received[operator.target].add(operator.kind)
    for owner in context.owners():
        own = {name for state in owner.states for name in state.runs}
        context.commanded[owner.name] |= own
        resumed = {"resume"} if received[owner.name] & {"suspend"} else set()
        for name in own:
            received[name] |= {"suspend", "restart", *resumed}
    for index, machine in enumerate(arrangement.machines):
        control = _control(context, index, machine, received[machine.name], surveys[machine.name])
        context.controls[machine.name] = control
        _declare_control(context, control, machine.name in wants_finished, received[machine.name])
    for index, plant in enumerate(arrangement.plants, len(context.controls)):
        surveyed = [_surveys(s) for s in plant.states]
        context.plants[plant.name] = _control(context, index, plant, set(), surveyed)
        _declare_control(context, context.plants[plant.name], False, set())


def _surveys(state: State) -> tuple[Survey, Survey]:
    """Of the actions that run while the clock is another state's, and of the others with the guards."""
    own = (state.on_entry, state.on_exit, state.internal, state.transitions)
    return survey((state.on_suspend, state.on_resume)), survey(own)


def _control(
    context: Context, index: int, machine: Machine, received: set[str], surveys: list[tuple[Survey, Survey]]
) -> Control:
    arrangement = context.arrangement
    states, suspend = machine.states, machine.suspend
    puts_aside = {"suspend", "load_suspended"}
    if suspend is None and (received & puts_aside or machine.suspended):
        states = (*states, State(IMPLICIT_SUSPEND, (), (), (), (), (), (), (), machine.span))
        suspend = len(states) - 1
    by_transition = suspend is not None and any(
        (i == suspend) != (t.target == suspend) for i, s in enumerate(states) for t in s.transitions
    )
    scheduled = machine.name not in arrangement.surroundings
    process, position = 0, -1
    if scheduled:
        process = next(i for i, p in enumerate(arrangement.processes) if machine.name in p.schedule)
        position = arrangement.processes[process].schedule.index(machine.name)
    due = [b for early, _ in surveys for b in early.bounds]
    if due and arrangement.timing == "untimed":
        # Such an action may read the clock of a state that was left before the one it belongs to was entered: ages of
        # all states count the same constants.
        due += [b for _, late in surveys for b in late.bounds]
    bounds, caps = [], []
    for number in range(len(states)):
        own = surveys[number][1].bounds if number < len(surveys) else ()
        if arrangement.timing == "untimed":
            bounds.append(tuple(sorted({b.constant for b in [*own, *due] if b.constant is not None})))
            caps.append(0)
        else:
            bounds.append(())
            assert arrangement.cycle_ms is not None or not own, "the loader asks for cycle_ms"
            caps.append(max((b.ticks(arrangement.cycle_ms) + 1 for b in [*own, *due]), default=0))
    return Control(
        index=index,
        machine=machine,
        states=states,
        suspend=suspend,
        process=process,
        position=position,
        pending=bool(received & {*COMMANDS, "enter"}),
        remembered=suspend is not None and "resume" in received,
        previous=suspend is not None
        and (by_transition or bool(received & puts_aside) or received >= {"enter", "resume"} or machine.suspended),
        leaves=any(s.finishes for i, s in enumerate(states) if i != suspend),
        bounds=tuple(bounds),
        caps=tuple(max(0, c) for c in caps),
        due_reads_clock=bool(due),
        absents=not machine.loaded or "unload" in received or machine.on_fault == "unload",
        keeps=arrangement.finished == "keep" or machine.nested,
        owned=tuple(dict.fromkeys(name for state in machine.states for name in state.runs)),
        reloads=bool(received & {"load", "load_suspended"}),
        enters="enter" in received,
        scheduled=scheduled,
    )


def _declare_control(context: Context, control: Control, wants_finished: bool, received: set[str]) -> None:
    machine, arrangement = control.machine, context.arrangement
    names = tuple(s.name for s in control.states)
    start = control.suspend if machine.suspended else machine.initial
    assert start is not None

    def add(what: str, kind: Type, init: int, labels: tuple[str, ...] = (), output: bool = False) -> None:
        context.control_var(control.var(what), kind, init, machine.name, labels, output)

    add("state", control.state.type, start, names)
    add("entered", BOOL, 0)
    if control.pending:
        kinds = ("none", *COMMANDS, *(f"enter {s.name}" for s in machine.states if control.enters))
        add("pending", control.waiting.type, 0, kinds, arrangement.profile.commands != "next_turn")
    if control.remembered:
        add("remembered", control.state.type, machine.initial, names)
    if control.previous:
        left = machine.initial + 1 if machine.suspended and machine.initial != control.suspend else 0
        add("previous", Int(0, len(names)), left, ("none", *names))
    if control.absents:
        add("loaded", BOOL, int(machine.loaded))
    operated = any(o.kind == "unload" and o.target == machine.name for o in arrangement.operators)
    if control.absents and (operated or machine.name in context.commanded.get(machine.name, frozenset())):
        add("unloads", BOOL, 0, output=True)
    if arrangement.access is not None and machine.has_refusals(arrangement.access):
        add("refused", BOOL, 0, output=True)
    if machine.on_fault == "unload":
        add("faulted", BOOL, 0, output=True)
    if machine.nested:
        add("done", BOOL, 0)
        if "resume" in received:
            add("together", BOOL, 0)
    if control.owned and control.suspend is not None and "suspend" in received:
        add("inside", BOOL, 0)
    if control.leaves and (not control.keeps or wants_finished or control.reloads):
        add("finished", BOOL, 0)
    if any(control.caps):
        add("clock", Int(0, max(control.caps)), 0)
    if any(control.bounds):
        add("age", Int(0, max(map(len, control.bounds))), 0)
        add("timely", BOOL, 0, output=True)
        for i, bounds in enumerate(control.bounds):
            if bounds:
                name = f"{machine.name}.{names[i]}.age"
                context.choices[name] = Choice(name, Int(0, len(bounds)), "age", "")


def machine_infos(context: Context) -> tuple[MachineInfo, ...]:
    result = []
    for control in context.every_control:
        transitions = tuple(
            tuple(TransitionInfo(t.target, t.text, t.span) for t in s.transitions) for s in control.states
        )
        names = tuple(s.name for s in control.states)
        result.append(MachineInfo(control.machine.name, names, transitions, control.suspend))
    return tuple(result)


def with_init(context: Context, name: str, init: int) -> None:
    """Change what a variable starts with (the initial configuration is canonical too)."""
    context.variables[name] = replace(context.variables[name], init=init)
