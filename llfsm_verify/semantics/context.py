"""What the lowering of one arrangement knows: its variables, choices and inputs under their step-program names."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement, Machine, State
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Variable
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Choice,
    Emit,
    EventKind,
    Expr,
    FaultSite,
    Get,
    Input,
    Int,
    MachineInfo,
    Origin,
    TransitionInfo,
    Type,
    Var,
)
from llfsm_verify.semantics.samples import Samples
from llfsm_verify.semantics.storage import element_names, element_values, labels, leaf_values, leaves, machine_type
from llfsm_verify.semantics.walk import Survey, survey

if TYPE_CHECKING:
    from llfsm_verify.semantics.parts import Parts
    from llfsm_verify.semantics.probes import Probes

SUSPEND, RESUME, RESTART = 1, 2, 3
"""Values of a machine's pending slot; 0 is empty."""
COMMANDS = {"suspend": SUSPEND, "resume": RESUME, "restart": RESTART}
IMPLICIT_SUSPEND = "__suspend"
RAN, CYCLE, FIRED, SPENT = "$ran", "$cycle", "$fired", "$spent"
"""The outputs every step has; no name of a user begins so."""
FIRST = "$first"
"""The variable that is true until the first letter behind the initial one."""


@dataclass(frozen=True, slots=True)
class InputScalar:
    """One scalar of an input. `stored`: it is a variable of the configuration, sampled into by `choice` when a cycle
    begins (`choice` "": never sampled)."""

    name: str
    type: Int
    labels: tuple[str, ...]
    stored: bool
    choice: str
    init: int
    source: str
    """The whiteboard variable that it is of."""
    driven: bool = False
    """The model of the surroundings writes it."""

    @property
    def varies(self) -> bool:
        return bool(self.choice) or self.driven


@dataclass(frozen=True, slots=True)
class Control:
    """The control variables of one machine: what exists of them depends on what can happen to the machine."""

    index: int
    machine: Machine
    states: tuple[State, ...]
    """The machine's states, the implicit suspend state included when there is one."""
    suspend: int | None
    """The suspend state's number; None: the machine can never be suspended."""
    process: int
    position: int
    """Its place in the process's schedule; -1: it begins the cycle."""
    pending: bool
    remembered: bool
    previous: bool
    leaves: bool
    """It can finish, so `finished` exists."""
    bounds: tuple[tuple[Fraction, ...], ...]
    """By state: the distinct constant bounds (ms) of `after` that its clock is compared with, ascending."""
    caps: tuple[int, ...]
    """By state: the tick at which a timed clock stops; 0: nobody reads it there."""
    due_reads_clock: bool
    """Some on_suspend or on_resume action reads the clock, so it matters before `on_entry` too."""
    absents: bool = False
    """It can be absent from the schedule: it is of the pool, or somebody may unload it."""
    keeps: bool = False
    """It stays in the schedule when it is finished."""
    owned: tuple[str, ...] = ()
    """The machines that its states run."""
    reloads: bool = False
    """Somebody may load it, so that it matters whether it has finished."""
    scheduled: bool = True
    """False: it is the model of the surroundings, whose ringlets are no steps."""

    def var(self, what: str) -> str:
        return f"{self.machine.name}.${what}"

    @property
    def state(self) -> Get:
        return Get(self.var("state"), None, Int(0, len(self.states) - 1))

    def flag(self, what: str) -> Get:
        return Get(self.var(what), None, BOOL)

    @property
    def clocked(self) -> bool:
        return any(self.caps) or any(self.bounds)

    def runs(self, state: int) -> tuple[str, ...]:
        """The machines that a state runs."""
        return self.states[state].runs

    def watches_clock(self, state: int) -> bool:
        """The clock matters in this state once it is entered."""
        return bool(self.caps[state] or self.bounds[state])


def emit(control: Control, kind: EventKind, *args: Expr) -> Emit:
    """Tell observers what happens to a machine."""
    return Emit(kind, control.index, args)


@dataclass(slots=True)
class Context:
    """Collects the program's tables while the blocks are lowered."""

    arrangement: Arrangement
    keep_all_bits: bool
    mentioned: frozenset[str] = frozenset()
    """Scalars of unstored inputs that atoms mention."""
    controls: dict[str, Control] = field(default_factory=dict)
    """The scheduled machines."""
    environment: Control | None = None
    """The model of the surroundings."""
    surroundings: Block = ()
    """Its ringlet."""
    inputs: dict[str, InputScalar] = field(default_factory=dict)
    variables: dict[str, Var] = field(default_factory=dict)
    choices: dict[str, Choice] = field(default_factory=dict)
    faults: dict[FaultSite, int] = field(default_factory=dict)
    refusals: dict[FaultSite, int] = field(default_factory=dict)
    commanded: dict[str, frozenset[str]] = field(default_factory=dict)
    """By machine: the machines that its actions command."""
    probes: Probes | None = None
    parts: Parts | None = None
    """Steps also tell what comes out at each place."""
    samples: Samples = field(default_factory=Samples)
    """What atoms ask about samples."""
    edges: list[Block] = field(default_factory=list)
    """What a letter does to tell how it differs from the one before, inner ones first."""
    entered: frozenset[str] = frozenset()
    """The machines whose entered flag atoms ask for, so that it stays as it is."""
    _reads: int = 0
    _chosen: Counter[str] = field(default_factory=Counter)

    # -------------------------------------------------- tables

    def add(self, var: Var) -> None:
        assert var.name not in self.variables, var.name
        self.variables[var.name] = var

    def control_var(
        self,
        name: str,
        kind: Type,
        init: int,
        machine: str = "",
        labels: tuple[str, ...] = (),
        output: bool = False,
    ) -> None:
        origin = Origin("output" if output else "control", machine, labels)
        self.add(Var(name, kind, init, origin, output=output))

    def fault(self, code: str, message: str, span: Span | None, variable: str = "") -> int:
        """The number of a fault site (equal ones are shared: a machine file used twice, an unrolled loop)."""
        return self.faults.setdefault(FaultSite(code, message, span, variable), len(self.faults))

    def refusal(self, message: str, span: Span) -> int:
        """The number of a place where a machine is refused something."""
        return self.refusals.setdefault(FaultSite("E157", message, span), len(self.refusals))

    def new_read(self, scalar: InputScalar) -> str:
        """A choice for one evaluated read (`snapshot: none`)."""
        self._reads += 1
        name = f"{scalar.name}#{self._reads}"
        self.choices[name] = Choice(name, scalar.type, "read", scalar.name, scalar.labels)
        return name

    def new_choice(self, machine: str, target: str, kind: Int, labels: tuple[str, ...]) -> str:
        """A choice for one evaluated `target = choose(…)` of a machine."""
        name = f"{machine}.choose({target})"
        self._chosen[name] += 1
        if self._chosen[name] > 1:
            name = f"{name}#{self._chosen[name]}"
        self.choices[name] = Choice(name, kind, "choose", "", labels)
        return name

    def operator_choice(self, name: str, kind: Int, labels: tuple[str, ...] = ()) -> str:
        """A choice of an operator, which every slot that can begin a cycle may make."""
        self.choices[name] = Choice(name, kind, "choose", "", labels)
        return name

    def letter_choice(self, scalar: InputScalar) -> str:
        """The choice by which a letter shows an input that its step has not read."""
        name = f"{scalar.name}#letter"
        if name not in self.choices:
            self.choices[name] = Choice(name, scalar.type, "input", scalar.name, scalar.labels)
        return name

    def control(self, machine: str) -> Control:
        if self.environment is not None and machine == self.environment.machine.name:
            return self.environment
        return self.controls[machine]

    def owners(self) -> list[Machine]:
        """The machines with states that run others, owners before what they run."""
        above = {name: m.name for m in self.arrangement.machines for s in m.states for name in s.runs}

        def depth(name: str) -> int:
            return 1 + depth(above[name]) if name in above else 0

        owners = [m for m in self.arrangement.machines if any(s.runs for s in m.states)]
        return sorted(owners, key=lambda m: depth(m.name))

    def affected(self, machine: str) -> list[str]:
        """The machines that the ringlet of a machine may give commands, owners before what they run."""
        found = set(self.commanded[machine])
        for owner in self.owners():
            if owner.name in found:
                found |= {name for s in owner.states for name in s.runs}
        order = {m.name: i for i, m in enumerate(self.owners())}
        return sorted(found, key=lambda m: (order.get(m, len(order)), list(self.controls).index(m)))

    def loads(self, machine: str) -> bool:
        """Somebody may load or unload the machine."""
        control = self.control(machine)
        return control.absents or control.reloads

    @property
    def every_control(self) -> list[Control]:
        """Of the scheduled machines, and of the model of the surroundings."""
        return [*self.controls.values(), *([] if self.environment is None else [self.environment])]

    @property
    def input_variables(self) -> frozenset[str]:
        """The whiteboard variables that are inputs."""
        return frozenset(e.variable.name for e in self.arrangement.whiteboard if e.role == "input")

    @property
    def tracks_samples(self) -> bool:
        """The letter cannot simply sample again: it shows a read's own choice, or an earlier ringlet's sample."""
        return self.arrangement.profile.snapshot == "none" or self.arrangement.observe == "cycle"


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
    if arrangement.environment is not None:
        surveyed = [_surveys(s) for s in arrangement.environment.states]
        context.environment = _control(context, len(context.controls), arrangement.environment, set(), surveyed)
        _declare_control(context, context.environment, False, set())


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
    scheduled = machine is not arrangement.environment
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
        pending=bool(received & COMMANDS.keys()),
        remembered=suspend is not None and "resume" in received,
        previous=suspend is not None and (by_transition or bool(received & puts_aside) or machine.suspended),
        leaves=any(s.finishes for i, s in enumerate(states) if i != suspend),
        bounds=tuple(bounds),
        caps=tuple(max(0, c) for c in caps),
        due_reads_clock=bool(due),
        absents=not machine.loaded or "unload" in received or machine.on_fault == "unload",
        keeps=arrangement.finished == "keep" or machine.nested,
        owned=tuple(dict.fromkeys(name for state in machine.states for name in state.runs)),
        reloads=bool(received & {"load", "load_suspended"}),
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
        add(
            "pending",
            Int(0, 3),
            0,
            ("none", "suspend", "resume", "restart"),
            arrangement.profile.commands != "next_turn",
        )
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
    if arrangement.access is not None and arrangement.access.refuses_some(machine):
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
