"""The semantics page, executed: ringlets of a validated arrangement without step programs, and every choice in them.

Written from the semantics page alone, as an oracle for the lowering; nothing of `llfsm_verify.semantics` is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TypeVar

from llfsm_verify.arrangement.model import ACTION_KINDS, Arrangement, Machine, State
from llfsm_verify.diagnostics import Span
from llfsm_verify.language import typed
from llfsm_verify.language.constants import interval
from llfsm_verify.language.types import BoolType, ScalarType, Value
from tests.oracle.evaluation import FaultError, evaluate, place_of, run, scalars_of, truth, values_of

Scalar = int | bool
Event = tuple[str, str, tuple[int, ...]]
"""Kind, machine, arguments as in `program.program.Emit`."""
Choose = Callable[[str, str, Sequence[Scalar]], Scalar]
"""Kind (`input`, `age`, `free`), name and possible values to the value."""
Picks = tuple[tuple[str, str, Scalar], ...]
ANEW = ("restart", "enter")
"""How commands begin that a resume does not replace."""


@dataclass(frozen=True, slots=True)
class MachineState:
    state: int
    """Index of the current state; -1: the implicit suspend state."""
    remembered: int
    """Where a resume goes: the state remembered by the last suspend command, else the initial one."""
    entered: bool = False
    due: tuple[tuple[str, int], ...] = ()
    """What runs before on_entry: (`on_suspend` or `on_resume`, of which state)."""
    pending: str | None = None
    """A command; `enter 2`: an operator lets it enter its state 2."""
    finished: bool = False
    left: bool = False
    loaded: bool = True
    done: bool = False
    """Of a machine inside a state: it has accepted since its owner entered the state."""
    together: bool = False
    """It was suspended with its owner."""
    inside: bool = False
    """Of an owner: it was suspended in a state that it had entered, whose machines go on with it."""
    clock: int = 0
    """Ticks since the state's clock restarted; untimed: the age."""
    clock_of: int = 0
    """The state for which it restarted."""
    seen: tuple[tuple[str, Scalar], ...] = ()
    """With `snapshot: after_entry`, the machine's previous sample."""


@dataclass(frozen=True, slots=True)
class ProcessState:
    turn: int = 0
    begins: bool = True
    """The next ringlet is the first of its cycle."""
    all_accept: bool = True
    """Every machine that had a turn in this cycle accepted."""
    ended: bool = False


@dataclass(frozen=True, slots=True)
class Configuration:
    variables: tuple[tuple[str, Value], ...]
    stored: tuple[tuple[str, Scalar], ...]
    """Inputs that keep their value between steps."""
    machines: tuple[MachineState, ...]
    processes: tuple[ProcessState, ...]
    ran: frozenset[str] = frozenset()
    fired: frozenset[tuple[str, int, int]] = frozenset()
    cycle: bool = False
    shown: tuple[tuple[str, Scalar], ...] = ()
    """The last sample of each unstored input that the step (the cycle so far) read."""
    started: bool = False
    """Not the initial configuration."""
    sampled: tuple[tuple[tuple[str, str], Scalar], ...] = ()
    """By machine ("": any) and scalar, what was sampled last: of what the atoms ask for."""
    samplers: frozenset[tuple[str, str]] = frozenset()
    """The machines and the inputs that they sampled in the step (the cycle so far)."""
    plants: tuple[MachineState, ...] = ()
    """Of the models of the surroundings."""
    faulted: frozenset[str] = frozenset()
    """The machines whose ringlet in the step (the cycle so far) ended in a fault that unloaded them."""
    refused: frozenset[str] = frozenset()
    """The machines that were refused something in the step (the cycle so far)."""
    before: tuple[Value, ...] = ()
    """What each `rose`, `fell` and `changed` looks at, in the last letter."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step; with a fault there is no `after`."""

    after: Configuration | None
    events: tuple[Event, ...]
    fault: tuple[str, int] | None
    """Code and line."""
    wide: bool
    letter: dict[str, bool] | None
    """The atoms that hold, where the step has a letter."""


T = TypeVar("T")


def every_way(act: Callable[[Choose], T]) -> Iterator[tuple[Picks, T]]:
    """Run `act` once for each combination of values that it asks for."""
    script: list[int] | None = []
    while script is not None:
        picks: list[tuple[str, str, Scalar]] = []
        sizes: list[int] = []
        indices: list[int] = []
        planned = script

        def choose(kind: str, name: str, values: Sequence[Scalar]) -> Scalar:
            at = len(picks)  # noqa: B023
            index = planned[at] if at < len(planned) else 0  # noqa: B023
            sizes.append(len(values))  # noqa: B023
            indices.append(index)  # noqa: B023
            picks.append((kind, name, values[index]))  # noqa: B023
            return values[index]

        result = act(choose)
        yield tuple(picks), result
        script = None
        for at in reversed(range(len(indices))):
            if indices[at] + 1 < sizes[at]:
                script = [*indices[:at], indices[at] + 1]
                break


def nodes(root: object, kind: type[T]) -> Iterator[T]:
    """All nodes of type `kind` in a typed tree."""
    if isinstance(root, kind):
        yield root
    if isinstance(root, tuple):
        for item in root:
            yield from nodes(item, kind)
    elif is_dataclass(root) and not isinstance(root, type | Span | typed.Variable):
        for f in fields(root):
            yield from nodes(getattr(root, f.name), kind)


class Direct:
    """An arrangement, and what can happen in it. `atoms`: state formulas by name, shown in letters."""

    def __init__(self, arrangement: Arrangement, atoms: dict[str, typed.Expression] | None = None) -> None:
        self.arrangement = arrangement
        self.profile = arrangement.profile
        self.atoms = atoms or {}
        self.edges = list(dict.fromkeys(nodes(tuple(self.atoms.values()), typed.Edge)))
        asked = list(nodes(tuple(self.atoms.values()), typed.Sampled))
        self.asked = {(s.machine, n): s.variable.name for s in asked for n, _ in scalars_of(*place_of(s))}
        """Machine and scalar of each `sampled`, with the input that the scalar is of."""
        self.by_name = {m.name: i for i, m in enumerate(arrangement.machines)}
        self.owner = {name: m.name for m in arrangement.machines for s in m.states for name in s.runs}
        self.process_of = {m: i for i, p in enumerate(arrangement.processes) for m in p.schedule}
        inputs = [w for w in arrangement.whiteboard if w.role == "input"]
        self.inputs = frozenset(w.variable.name for w in inputs)
        self.input_types: dict[str, ScalarType] = {}
        self.input_inits: dict[str, Scalar] = {}
        self.changes: dict[str, str] = {}
        self.free: set[str] = set()
        self.source: dict[str, str] = {}
        """The input that a scalar is of."""
        for w in inputs:
            flat = _flat(w.variable.init)
            for (name, kind), value in zip(scalars_of(w.variable.name, w.variable.type), flat, strict=True):
                self.input_types[name], self.input_inits[name], self.changes[name] = kind, value, w.changes
                self.source[name] = w.variable.name
                if w.free:
                    self.free.add(name)
        self.plants = arrangement.plants
        written = {a.target.variable.name for a in nodes(_all_texts(self.plants), typed.Assign)
                   if isinstance(a.target, typed.Read)}  # fmt: skip
        self.driven = {w.variable.name: w.variable for w in inputs if w.variable.name in written}
        """The inputs that the models of the surroundings write."""
        held = self.profile.snapshot == "cycle"
        self.stored = {n for n, c in self.changes.items() if c != "step" or held or self.source[n] in self.driven}
        self.constant = {n for n, c in self.changes.items() if c == "never"}
        self.clocks = {
            (m.name, i): _Clock(m, i, arrangement) for m in arrangement.texts for i in range(-1, len(m.states))
        }

    @cached_property
    def early(self) -> dict[str, list[str]]:
        """By machine, the inputs (but constant ones) that on_entry, on_suspend and on_resume read (whole variables):
        with `snapshot: after_entry` those see the machine's previous sample, so that sample has to be remembered."""
        found: dict[str, list[str]] = {}
        for m in self.arrangement.machines:
            reads = [r for s in m.states for r in nodes((s.on_entry, s.on_suspend, s.on_resume), typed.Read)]
            own = {r.variable.name: r.variable.type for r in reads if r.variable.name in self.inputs}
            read = {n for name, kind in own.items() for n, _ in scalars_of(name, kind)}
            found[m.name] = [n for n in self.input_types if n in read and n not in self.constant]
        return found

    def suspend_state(self, machine: Machine) -> int:
        return -1 if machine.suspend is None else machine.suspend

    def runs(self, machine: Machine, index: int) -> tuple[str, ...]:
        """The machines that a state runs."""
        return () if index < 0 else machine.states[index].runs

    def depth(self, name: str) -> int:
        """How many owners there are above a machine."""
        return 1 + self.depth(self.owner[name]) if name in self.owner else 0

    @cached_property
    def order(self) -> list[str]:
        """Owners before what they run, then the others."""
        owners = set(self.owner.values())
        return sorted(self.by_name, key=lambda n: (n not in owners, self.depth(n) if n in owners else 0))

    def state(self, machine: Machine, index: int) -> State | None:
        return None if index < 0 else machine.states[index]

    # ------------------------------------------------------------ the beginning

    def initial(self) -> list[Configuration]:
        """The initial configurations: one for each value of the inputs that are chosen before the run."""
        return [replace(c, before=self.looked_at(c, _none)) for _, c in every_way(self._initial)]

    def looked_at(self, c: Configuration, choose: Choose) -> tuple[Value, ...]:
        """What the atoms' `rose`, `fell` and `changed` compare, in the letter of `c`."""
        view = _Turn(self, c, choose)
        view.open_letter()
        return tuple(evaluate(e.operand, view, {}) for e in self.edges)

    def fresh(self, m: Machine) -> MachineState:
        """A machine as it starts, or as a load finds it."""
        after_entry = self.profile.snapshot == "after_entry"
        seen = tuple((n, self.input_inits[n]) for n in self.early[m.name]) if after_entry else ()
        return MachineState(m.initial, m.initial, clock_of=m.initial, seen=seen)

    def _initial(self, choose: Choose) -> Configuration:
        variables = [w.variable for w in self.arrangement.whiteboard if w.role != "input"]
        variables += [v for m in self.arrangement.texts for v in m.variables]
        variables += [v for m in self.arrangement.texts for s in m.states for v in s.variables]
        first = dict(self.input_inits)
        for name in self.input_types:
            if name in self.free:
                first[name] = choose("free", name, values_of(self.input_types[name]))
        machines = []
        for m in self.arrangement.machines:
            state = replace(self.fresh(m), loaded=m.loaded)
            if m.suspended and m.initial != self.suspend_state(m):
                suspend = self.suspend_state(m)
                state = replace(state, state=suspend, due=(("on_suspend", m.initial),))
            machines.append(state)
        return Configuration(
            tuple((v.name, v.init) for v in variables),
            tuple((n, v) for n, v in first.items() if n in self.stored),
            tuple(machines),
            tuple(ProcessState() for _ in self.arrangement.processes),
            sampled=tuple((key, self.input_inits[key[1]]) for key in self.asked),
            plants=tuple(MachineState(p.initial, p.initial, clock_of=p.initial) for p in self.plants),
        )

    # ------------------------------------------------------------ steps

    def enabled(self, c: Configuration) -> list[int | None]:
        """The processes that may step; [None]: all have ended, and the last configuration repeats."""
        live: list[int | None] = [i for i, p in enumerate(c.processes) if not p.ended]
        return live or [None]

    def successors(self, c: Configuration) -> Iterator[tuple[int | None, Picks, Step]]:
        """Every step from `c`: each process, each sample of the inputs read, each age."""
        for process in self.enabled(c):
            for picks, step in every_way(lambda choose: self.step(c, process, choose)):  # noqa: B023
                yield process, picks, step

    def step(self, c: Configuration, process: int | None, choose: Choose) -> Step:
        turn = _Turn(self, c, choose)
        try:
            if process is None:
                turn.repeat()
            else:
                turn.ringlet(process)
            after = turn.configuration()
            letter = None
            if self.has_letter(after, process):
                view = _Turn(self, after, choose)
                view.open_letter()
                letter = {name: truth(e, view, {}) for name, e in self.atoms.items()}
                after = replace(after, before=tuple(evaluate(e.operand, view, {}) for e in self.edges))
        except FaultError as fault:
            return Step(None, tuple(turn.events), (fault.code, fault.span.line), turn.wide, None)
        return Step(after, tuple(turn.events), None, turn.wide, letter)

    def has_letter(self, after: Configuration, process: int | None) -> bool:
        return self.arrangement.observe == "ringlet" or after.cycle or process is None

    def letter(self, c: Configuration, choose: Choose) -> dict[str, bool]:
        """The values of the atoms in `c`; inputs that nobody read are free."""
        view = _Turn(self, c, choose)
        view.open_letter()
        return {name: truth(e, view, {}) for name, e in self.atoms.items()}


class _Clock:
    """What one state compares its clock with."""

    def __init__(self, machine: Machine, index: int, arrangement: Arrangement) -> None:
        own = () if index < 0 else _texts(machine.states[index])
        # Ages are finer than the page asks: they also tell the constants of actions that run before a clock restarts.
        early = tuple((s.on_suspend, s.on_resume) for s in machine.states)
        if any(nodes(early, typed.After)):
            own = tuple(_texts(s) for s in machine.states)
        self.constants = sorted({a.bound for a in nodes(own, typed.After) if isinstance(a.bound, Fraction)})
        self.period = arrangement.cycle_ms or Fraction(1)
        largest = Fraction(0)
        for after in (a for s in machine.states for a in nodes(_texts(s), typed.After)):
            if isinstance(after.bound, Fraction):
                largest = max(largest, after.bound)
            else:
                bounds = interval(after.bound)
                assert bounds is not None
                largest = max(largest, Fraction(bounds[1] * after.scale))
        self.last = largest // self.period + 1
        """Ticks beyond every bound of the machine: counting further changes nothing."""


def _none(kind: str, name: str, values: Sequence[Scalar]) -> Scalar:
    raise AssertionError(f"the first letter chooses {kind} {name}")


def _texts(state: State) -> tuple[object, ...]:
    return (*(getattr(state, k) for k in ACTION_KINDS), *(t.guard for t in state.transitions))


def _all_texts(machines: Sequence[Machine]) -> tuple[object, ...]:
    return tuple(_texts(s) for machine in machines for s in machine.states)


def _flat(value: Value) -> list[Scalar]:
    return [s for v in value for s in _flat(v)] if isinstance(value, tuple) else [value]


def _shaped(like: Value, values: Iterator[Scalar]) -> Value:
    """A value of the shape of `like`, of the scalars `values`."""
    return tuple(_shaped(v, values) for v in like) if isinstance(like, tuple) else next(values)


class _Turn:
    """One step under way; the world of the guards and actions that run in it."""

    def __init__(self, direct: Direct, c: Configuration, choose: Choose) -> None:
        self.direct = direct
        self.arrangement = direct.arrangement
        self.profile = direct.profile
        self.before = c
        self.choose = choose
        self.variables = dict(c.variables)
        self.stored = dict(c.stored)
        self.machines = dict(zip(direct.by_name, c.machines, strict=True))
        self.machines |= zip((plant.name for plant in direct.plants), c.plants, strict=True)
        self.processes = list(c.processes)
        self.inputs = direct.inputs
        self.wide = False
        self.events: list[Event] = []
        goes_on = direct.arrangement.observe == "cycle" and not c.cycle and c.started
        self.ran = set(c.ran) if goes_on else set()
        self.fired = set(c.fired) if goes_on else set()
        self.shown = dict(c.shown) if goes_on else {}
        self.cycle = False
        self.snapshot: dict[str, Scalar] = {}
        self.early = False
        """Before the sample of `snapshot: after_entry`."""
        self.letter = False
        self.sampled_last = dict(c.sampled)
        self.samplers = set(c.samplers) if goes_on else set()
        self.me = ""
        self.no_time = False
        """The clock restarted in this ringlet."""
        self.faulted = set(c.faulted) if goes_on else set()
        self.refused = set(c.refused) if goes_on else set()
        self.unloads = False
        """The machine has unloaded itself, which acts when its ringlet is over."""

    def configuration(self) -> Configuration:
        return Configuration(
            tuple(self.variables.items()), tuple(self.stored.items()),
            tuple(self.machines[n] for n in self.direct.by_name),
            tuple(self.processes), frozenset(self.ran), frozenset(self.fired), self.cycle,
            tuple(sorted(self.shown.items())), True, tuple(self.sampled_last.items()), frozenset(self.samplers),
            tuple(self.machines[plant.name] for plant in self.direct.plants),
            frozenset(self.faulted), frozenset(self.refused), self.before.before,
        )  # fmt: skip

    def repeat(self) -> None:
        """All processes have ended: nothing changes any more."""
        self.ran, self.fired, self.shown, self.samplers, self.faulted = set(), set(), {}, set(), set()
        self.refused = set()

    # ------------------------------------------------------------ one ringlet (section 2)

    def ringlet(self, number: int) -> None:
        process = self.arrangement.processes[number]
        name = process.schedule[self.processes[number].turn]
        self.me = name
        machine = self.arrangement.machine(name)
        self._new_samples(number)
        self.ran.add(name)
        command, state = self.machines[name].pending, self.machines[name]
        self.machines[name] = replace(state, pending=None)
        if command is not None:
            self._act(name, command)
        before = dict(self.variables), dict(self.machines), list(self.processes)
        accepts = False
        try:
            if self.profile.snapshot == "ringlet":
                self._take_sample(machine, self._texts_of_ringlet(machine))
            self._enter(machine)
            self._sample_after_entry(name)
            accepts = self._guards(machine)
        except FaultError as fault:
            if machine.on_fault == "end":
                raise
            self.variables, self.machines, self.processes = before
            self.machines[name] = replace(self.machines[name], pending=None)
            self.processes[number] = replace(self.processes[number], all_accept=False)
            self.fired -= {f for f in self.fired if f[0] == name}
            self.faulted.add(name)
            self._tell("faulted", name, fault.span.line)
            self.early = False
            self.unloads = True
        mine = self.machines[name]
        if accepts and not self.suspended(name) and not (mine.pending or "").startswith(("suspend", *ANEW)):
            leaves = self.arrangement.finished == "leave" and name not in self.direct.owner
            self.machines[name] = replace(mine, finished=True, left=leaves)
        if accepts and not self.suspended(name):
            self.machines[name] = replace(self.machines[name], done=True)
        self._act_at_once()
        if self.unloads:
            self._unload(name)
            self._act_at_once()
        self._pass_on(number, accepts)

    def _new_samples(self, number: int) -> None:
        """The environment's turn at the beginning of a cycle."""
        if not self.processes[number].begins:
            return
        self.processes[number] = replace(self.processes[number], begins=False)
        for operator in self.arrangement.operators:
            self._operate(operator.kind, operator.target)
        for plant in self.direct.plants:
            self._surroundings(plant)
        for name, changes in self.direct.changes.items():
            if self.direct.source[name] in self.direct.driven:
                continue
            if changes == "cycle" or (changes == "step" and name in self.direct.stored):
                self.stored[name] = self.choose("input", name, values_of(self.direct.input_types[name]))
        if self.profile.snapshot == "cycle":
            self.samplers |= {(self.me, name) for name in self.inputs}

    def _operate(self, kind: str, target: str) -> None:
        """What an operator may do where a cycle begins."""
        if not self.choose("choose", f"operator.{kind}", (False, True)):
            return
        if kind == "write":
            variable = next(w.variable for w in self.arrangement.whiteboard if w.variable.name == target)
            self.variables[target] = self.choose("choose", "operator.value", values_of(variable.type))
            return
        if kind in ("load", "load_suspended"):
            self.load(kind, target, operator=True)
            return
        if kind == "enter":
            states = self.arrangement.machine(target).states
            kind = f"enter {self.choose('choose', 'operator.state', range(len(states)))}"
        self.command(kind, target)
        self._act_at_once()

    def _act_at_once(self) -> None:
        """Under `commands: end_of_ringlet`, where a ringlet ends or an operator has commanded: owners first."""
        for other in self.direct.order if self.profile.commands == "end_of_ringlet" else ():
            its = self.machines[other]
            if its.pending is not None:
                self.machines[other] = replace(its, pending=None)
                self._act(other, its.pending)

    # ------------------------------------------------------------ plants (section 10)

    def _surroundings(self, env: Machine) -> None:
        """The ringlet of a model of the surroundings, to which the inputs that they write are variables."""
        me, inputs, fired = self.me, self.inputs, set(self.fired)
        self.me, self.inputs = env.name, frozenset()
        for name, variable in self.direct.driven.items():
            values = iter([self.stored[n] for n, _ in scalars_of(name, variable.type)])
            self.variables[name] = _shaped(variable.init, values)
        try:
            self._enter(env)
            self._guards(env)
        except FaultError as fault:
            codes = {"F001": "F011", "F002": "F012", "F003": "F013", "F004": "F014", "F005": "F015"}
            raise FaultError(codes[fault.code], fault.span) from None
        for name, variable in self.direct.driven.items():
            names = [n for n, _ in scalars_of(name, variable.type)]
            self.stored |= dict(zip(names, _flat(self.variables.pop(name)), strict=True))
        self.me, self.inputs, self.fired, self.no_time, self.early = me, inputs, fired, False, False

    def chosen(self, e: typed.Choose) -> Scalar:
        values: list[Scalar] = [bool(v) if isinstance(e.type, BoolType) else v for v in e.values]
        return values[0] if len(values) == 1 else self.choose("choose", f"{self.me}.choose", values)

    # ------------------------------------------------------------ samples (section 8)

    def _texts_of_ringlet(self, machine: Machine) -> tuple[object, ...]:
        """What a ringlet in the present state may run, of which the inputs mentioned are its sample."""
        its = self.machines[machine.name]
        state = self.direct.state(machine, its.state)
        texts: list[object] = []
        if state is not None:
            texts += [state.transitions, state.internal, state.on_exit]
        if not its.entered:
            texts += [state.on_entry] if state is not None else []
            due = [(kind, self.direct.state(machine, i)) for kind, i in its.due]
            texts += [getattr(left, kind) for kind, left in due if left is not None]
        return tuple(texts)

    def _take_sample(self, machine: Machine, texts: tuple[object, ...]) -> None:
        """Sample the inputs that `texts` mention, as far as the atoms ask for what was sampled."""
        mentioned = {r.variable.name for r in nodes(texts, typed.Read)} & self.inputs
        name = machine.name
        for scalar, kind in self.direct.input_types.items():
            keys = [key for key in (("", scalar), (name, scalar)) if key in self.direct.asked]
            if keys and self.direct.asked[keys[0]] in mentioned:
                unseen = scalar not in self.shown
                value = self.sample(scalar, kind)
                if unseen and self.arrangement.observe == "cycle":
                    self.shown.pop(scalar, None)  # the letter shows what was evaluated
                self.sampled_last |= dict.fromkeys(keys, value)
        self.samplers |= {(name, variable) for variable in mentioned}

    def _run(self, kind: str, name: str, state: int) -> None:
        machine = self.arrangement.machine(name)
        self._tell("entry" if kind == "on_entry" else "exit" if kind == "on_exit" else kind, name, state)
        own = self.direct.state(machine, state)
        if own is not None:
            run(getattr(own, kind), self, {})

    def _enter(self, machine: Machine) -> None:
        me = self.machines[machine.name]
        if me.entered:
            self._grow_older(machine.name)
            return
        self.early = self.profile.snapshot == "after_entry"
        if any(any(nodes(getattr(machine.states[i], kind), typed.After)) for kind, i in me.due if i >= 0):
            self._grow_older(machine.name)
        for kind, state in me.due:
            self._run(kind, machine.name, state)
        self.no_time = True
        self._change(entered=True, due=(), clock=0, clock_of=me.state)
        self._run("on_entry", machine.name, me.state)
        self._run_inner(machine, me.state)
        self.early = False

    def _grow_older(self, name: str) -> None:
        """Untimed: any of the state's constants may have passed since the last turn."""
        age, most = self.machines[name].clock, len(self.direct.clocks[name, self.machines[name].clock_of].constants)
        if self.arrangement.timing == "untimed" and age < most:
            self._change(clock=self.choose("age", name, range(age, most + 1)))

    def _sample_after_entry(self, name: str) -> None:
        if self.profile.snapshot == "after_entry":
            kinds = self.direct.input_types
            self._change(seen=tuple((n, self.sample(n, kinds[n])) for n in self.direct.early[name]))
            machine = self.arrangement.machine(name)
            state = self.direct.state(machine, self.machines[name].state)
            texts: list[object] = [
                getattr(s, k) for s in machine.states for k in ("on_entry", "on_suspend", "on_resume")
            ]
            if state is not None:
                texts += [state.transitions, state.internal, state.on_exit]
            self._take_sample(machine, tuple(texts))

    def _guards(self, machine: Machine) -> bool:
        """Evaluate the guards, fire or run internal; whether the machine accepts."""
        source = self.machines[machine.name].state
        state = self.direct.state(machine, source)
        for number, transition in enumerate(state.transitions if state is not None else ()):
            holds = truth(transition.guard, self, {})
            self._tell("guard", machine.name, source, number, int(holds))
            if holds:
                self._fire(machine, source, number, transition.target)
                return False
        self._run("internal", machine.name, source)
        if state is None or not (state.transitions or state.stays):
            self._tell("accept", machine.name, source)
            return True
        return False

    def _fire(self, machine: Machine, source: int, number: int, target: int) -> None:
        self.fired.add((machine.name, source, number))
        suspend = self.direct.suspend_state(machine)
        if target != source:
            due: tuple[tuple[str, int], ...] = ()
            if target == suspend:
                due = (("on_suspend", source),)
            elif source == suspend:
                due = (("on_resume", source), ("on_resume", target))
            self._change(state=target, entered=False, due=due)
            for name in self.direct.runs(machine, source):
                self.command("suspend", name)
            if source == suspend:
                self._forget_inner(machine.name)
        self._run("on_exit", machine.name, source)
        if target == source and self.profile.self_transition_restarts_clock:
            self._change(clock=0)

    def _pass_on(self, number: int, accepts: bool) -> None:
        process = self.processes[number]
        self.processes[number] = replace(process, all_accept=process.all_accept and accepts)
        self.cycle = self._next_turn(number)

    def _next_turn(self, number: int) -> bool:
        """The turn goes to the next live machine; whether the cycle is over."""
        schedule = self.arrangement.processes[number].schedule
        process = self.processes[number]
        live = [i for i, m in enumerate(schedule) if self.machines[m].loaded and not self.machines[m].left]
        later = [i for i in live if i > process.turn]
        if later:
            self.processes[number] = replace(process, turn=later[0])
            return False
        ended = process.all_accept or not live
        turn = live[0] if live else 0
        self.processes[number] = replace(process, turn=turn, begins=True, ended=ended, all_accept=True)
        if self.arrangement.timing == "timed":
            for m in (*schedule, *(plant.name for plant in self.direct.plants)):
                last = self.direct.clocks[m, 0].last
                self.machines[m] = replace(self.machines[m], clock=min(self.machines[m].clock + 1, last))
        return True

    # ------------------------------------------------------------ machines inside states (section 12)

    def _run_inner(self, machine: Machine, state: int) -> None:
        """Behind `on_entry`."""
        runs = self.direct.runs(machine, state)
        if not runs:
            return
        goes_on = self.machines[machine.name].inside
        for name in runs:
            its = self.machines[name]
            if not goes_on:
                self.machines[name] = replace(its, done=False, together=False)
                self.command("restart", name)
            elif its.together:
                self.machines[name] = replace(its, together=False)
                self.command("resume", name)
        self._change(inside=False)

    def _forget_inner(self, owner: str) -> None:
        for name, above in self.direct.owner.items():
            if above == owner:
                self.machines[name] = replace(self.machines[name], together=False)
        self.machines[owner] = replace(self.machines[owner], inside=False)

    def _drop_inner(self, owner: str) -> None:
        """Before a restart or unload of an owner."""
        machine = self.arrangement.machine(owner)
        for name in self.direct.runs(machine, self.machines[owner].state):
            self.command("suspend", name)
        self._forget_inner(owner)

    def _set_inner_aside(self, owner: str) -> None:
        """Before an owner is suspended."""
        self._forget_inner(owner)
        machine, its = self.arrangement.machine(owner), self.machines[owner]
        runs = self.direct.runs(machine, its.state)
        for name in runs:
            inner = self.machines[name]
            runs_now = not self.suspended(name) and inner.pending != "suspend"
            if runs_now or (inner.pending or "").startswith(("resume", *ANEW)):
                self.machines[name] = replace(inner, together=True)
                self.command("suspend", name)
        self.machines[owner] = replace(self.machines[owner], inside=bool(runs) and its.entered)

    # ------------------------------------------------------------ pools

    def load(self, kind: str, name: str, *, operator: bool = False) -> None:
        """`load`, `load_suspended` and `unload`."""
        number = self.direct.process_of[name]
        its, process = self.machines[name], self.processes[number]
        if process.ended:
            return
        if kind == "unload":
            if name == self.me:
                self.unloads = True
            elif its.loaded:
                self._unload(name)
                schedule = self.arrangement.processes[number].schedule
                if self.direct.process_of[self.me] != number and schedule[process.turn] == name:
                    self._next_turn(number)
            return
        if (name == self.me and not operator) or (its.loaded and not its.finished):
            return
        self._forget(name)
        self._tell("load", name)
        self.processes[number] = replace(process, all_accept=False)
        if kind == "load_suspended":
            machine = self.arrangement.machine(name)
            suspend = self.direct.suspend_state(machine)
            self._tell("suspend", name, machine.initial, suspend)
            if suspend != machine.initial:
                due = (("on_suspend", machine.initial),)
                self.machines[name] = replace(self.machines[name], state=suspend, due=due)

    def _unload(self, name: str) -> None:
        self._tell("unload", name)
        if name in self.direct.owner.values():
            self._drop_inner(name)
        self._forget(name)
        self.machines[name] = replace(self.machines[name], loaded=False)

    def _forget(self, name: str) -> None:
        machine = self.arrangement.machine(name)
        self.machines[name] = self.direct.fresh(machine)
        own = (*machine.variables, *(v for s in machine.states for v in s.variables))
        self.variables |= {v.name: v.init for v in own}

    # ------------------------------------------------------------ clearances (section 9)

    def refuses_write(self, variable: str, line: int) -> bool:
        """Whether the machine that acts may not write there, which is told."""
        access = self.arrangement.access
        if access is None or access.machines.get(self.me, 0) >= access.write.get(variable, 0):
            return False
        self._refuse(line)
        return True

    def issue(self, kind: str, machine: str, line: int) -> None:
        """A command of the machine that acts."""
        access = self.arrangement.access
        if access is not None and not (machine == self.me and kind in ("suspend", "resume", "restart")):
            mine = access.machines.get(self.me, 0)
            if mine < access.command.get(machine, access.machines.get(machine, 0)):
                self._refuse(line)
                return
        self.command(kind, machine)

    def _refuse(self, line: int) -> None:
        self._tell("refused", self.me, line)
        self.refused.add(self.me)

    # ------------------------------------------------------------ commands (section 4)

    def command(self, kind: str, machine: str) -> None:
        its = self.machines[machine]
        if kind in ("load", "load_suspended", "unload"):
            self.load(kind, machine)
            return
        if its.left or not its.loaded or self.processes[self.direct.process_of[machine]].ended:
            return
        if not (kind == "resume" and (its.pending or "").startswith(ANEW)):
            self.machines[machine] = replace(its, pending=kind)

    def _act(self, name: str, command: str) -> None:
        machine, its = self.arrangement.machine(name), self.machines[name]
        suspend = self.direct.suspend_state(machine)
        if command == "suspend":
            self._tell("suspend", name, its.state, suspend)
            if its.state != suspend:
                if name in self.direct.owner.values():
                    self._set_inner_aside(name)
                    its = self.machines[name]
                due = (("on_suspend", its.state),)
                its = replace(its, state=suspend, remembered=its.state, entered=False, due=due, finished=False)
        elif command == "resume":
            if its.state == suspend:
                self._tell("resume", name, suspend, its.remembered)
                due = (("on_resume", suspend), ("on_resume", its.remembered))
                if its.remembered == suspend:  # the page is silent: it goes nowhere, so no state is left or resumed
                    due = ()
                its = replace(its, state=its.remembered, entered=False, due=due, finished=False)
        else:
            kind, _, number = command.partition(" ")
            where = int(number) if number else machine.initial
            self._tell(kind, name, its.state, *([where] if number else []))
            if its.state != where or self.profile.restart_enters_initial:
                if name in self.direct.owner.values():
                    self._drop_inner(name)
                    its = self.machines[name]
                its = replace(its, state=where, entered=False, due=())
            its = replace(its, finished=False)
        self.machines[name] = its

    # ------------------------------------------------------------ what guards and actions see

    def sample(self, scalar: str, kind: ScalarType) -> Scalar:
        value = self._sample(scalar, kind)
        if not self.letter and self.profile.snapshot == "none":
            keys = [key for key in (("", scalar), (self.me, scalar)) if key in self.direct.asked]
            self.sampled_last |= dict.fromkeys(keys, value)
            self.samplers.add((self.me, self.direct.source[scalar]))
        return value

    def sampled(self, machine: str, scalar: str) -> Scalar:
        return self.stored[scalar] if self.profile.snapshot == "cycle" else self.sampled_last[machine, scalar]

    def has_sampled(self, machine: str, variable: str) -> bool:
        return (machine, variable) in self.samplers

    def edge(self, e: typed.Edge) -> bool:
        now = evaluate(e.operand, self, {})
        if not self.before.started:
            return False
        before = self.before.before[self.direct.edges.index(e)]
        return now != before and (e.kind == "changed" or now is (e.kind == "rose"))

    def _sample(self, scalar: str, kind: ScalarType) -> Scalar:
        if self.early and scalar not in self.direct.constant:
            return dict(self.machines[self.me].seen)[scalar]
        if scalar in self.stored:
            return self.stored[scalar]
        if self.letter:
            if scalar not in self.shown:
                free = self.before.started
                first = self.direct.input_inits[scalar]
                self.shown[scalar] = self.choose("free", scalar, values_of(kind)) if free else first
            return self.shown[scalar]
        if self.profile.snapshot == "none" or scalar not in self.snapshot:
            self.snapshot[scalar] = self.choose("input", scalar, values_of(kind))
        self.shown[scalar] = self.snapshot[scalar]
        return self.snapshot[scalar]

    def passed(self, milliseconds: Fraction) -> bool:
        me = self.machines[self.me]
        clock = self.direct.clocks[self.me, me.clock_of]
        if self.arrangement.timing == "timed":
            return me.clock * clock.period > milliseconds
        if self.no_time:
            return False
        return clock.constants.index(milliseconds) < me.clock

    def at(self, machine: str, state: int) -> bool:
        return self.machines[machine].loaded and self.machines[machine].state == state

    def running(self, machine: str) -> bool:
        its = self.machines[machine]
        gone = its.left or not its.loaded or self.processes[self.direct.process_of[machine]].ended
        return not gone and not self.suspended(machine)

    def is_done(self, machine: str) -> bool:
        return self.machines[machine].loaded and self.machines[machine].done

    def suspended(self, machine: str) -> bool:
        its = self.machines[machine]
        return its.loaded and its.state == self.direct.suspend_state(self.arrangement.machine(machine))

    # ------------------------------------------------------------ what properties see (section 6)

    def open_letter(self) -> None:
        """Look at the configuration as its letter does."""
        c = self.before
        self.letter, self.ran, self.fired = True, set(c.ran), set(c.fired)
        self.cycle, self.shown, self.samplers, self.faulted = c.cycle, dict(c.shown), set(c.samplers), set(c.faulted)
        self.refused = set(c.refused)

    def observe(self, what: typed.Observe) -> bool:
        match what.kind:
            case "ran":
                return what.machine in self.ran
            case "fired":
                return (what.machine, what.state, what.transition) in self.fired
            case "cycle":
                return self.cycle
            case "suspended":
                return self.suspended(what.machine)
            case "entered":
                return self.machines[what.machine].loaded and self.machines[what.machine].entered
            case "finished":
                return self.machines[what.machine].finished
            case "refused":
                return what.machine in self.refused
            case "faulted":
                return what.machine in self.faulted
            case "loaded":
                return self.machines[what.machine].loaded
        return False

    # ------------------------------------------------------------ helpers

    def _change(self, **changes: object) -> None:
        self.machines[self.me] = replace(self.machines[self.me], **changes)  # type: ignore[arg-type]

    def _tell(self, kind: str, name: str, *args: int) -> None:
        implicit = len(self.arrangement.machine(name).states)
        states = 2 if kind in ("suspend", "resume") else 1
        shown = tuple(implicit if a == -1 and i < states else a for i, a in enumerate(args))
        self.events.append((kind, name, shown))


__all__ = ["Configuration", "Direct", "Step", "evaluate"]
