"""The validated arrangement: what the loader promises, and what everything else reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from llfsm_verify.arrangement.requests import Request
from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.language.scope import Table
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, Command, Expression, LetIn, Read, Statement, Variable
from llfsm_verify.language.types import EnumType, Type, Value


@dataclass(frozen=True, slots=True)
class Access:
    """The key `access` of an arrangement. Levels are counted from 0, the lowest."""

    levels: tuple[str, ...]
    machines: Mapping[str, int]
    """The clearances of machines; of one that is not named the lowest."""
    write: Mapping[str, int]
    """The classes of whiteboard variables: the clearance that a write needs; of one that is not named the lowest."""
    command: Mapping[str, int]
    """The classes of machines: the clearance that a command to them needs; of one that is not named its own."""
    users: Mapping[str, int]
    """The clearances of people and programs outside, by the names of their accounts."""
    refuses: bool
    """What a machine may not do is refused when it runs; else such a text is an error."""
    marks: Mapping[str, Span] = field(default_factory=dict, compare=False, repr=False)
    """Where ``levels`` stands, and each level that is given, as in ``machines.ns``."""

    def clearance(self, machine: str) -> int:
        return self.machines.get(machine, 0)

    def write_class(self, variable: str) -> int:
        return self.write.get(variable, 0)

    def command_class(self, machine: str) -> int:
        return self.command.get(machine, self.clearance(machine))

    def may_write(self, machine: str, variable: str) -> bool:
        """Whether a machine may write a variable of the whiteboard."""
        return self.clearance(machine) >= self.write_class(variable)

    def may_command(self, machine: str, kind: str, target: str) -> bool:
        """Whether a machine may give this command; itself it may always suspend, resume and restart."""
        own = machine == target and kind in ("suspend", "resume", "restart")
        return own or self.clearance(machine) >= self.command_class(target)

    def write_denial(self, machine: str, variable: str) -> str:
        """What is said when the machine may not write the variable."""
        return self._denial(machine, f"write `{variable}`", self.write_class(variable))

    def command_denial(self, machine: str, kind: str, target: str) -> str:
        """What is said when the machine may not give this command."""
        return self._denial(machine, f"{kind} `{target}`".replace("load_suspended", "load"), self.command_class(target))

    def _denial(self, machine: str, what: str, needed: int) -> str:
        has = self.levels[self.clearance(machine)]
        return f"machine `{machine}` ({has}) may not {what}: that needs `{self.levels[needed]}`"


Base = Literal["llfsm", "clfsm", "swiftfsm"]
Snapshot = Literal["none", "ringlet", "after_entry", "cycle"]
Commands = Literal["next_turn", "end_of_ringlet"]
Observe = Literal["ringlet", "cycle"]
Timing = Literal["timed", "untimed"]
Finished = Literal["leave", "keep"]
Fairness = Literal["processes", "none"]
Role = Literal["input", "output", "shared"]
Changes = Literal["step", "cycle", "never"]
OnFault = Literal["end", "unload"]
ActionKind = Literal["on_entry", "on_exit", "internal", "on_suspend", "on_resume"]
ACTION_KINDS: tuple[ActionKind, ...] = ("on_entry", "on_exit", "internal", "on_suspend", "on_resume")


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition of a state, tried in their order."""

    guard: Expression
    target: int
    """Index of the target state in the machine's states."""
    text: str
    """The guard as the user wrote it (white space folded)."""
    span: Span


@dataclass(frozen=True, slots=True)
class State:
    """A state of a machine instance, its actions typed."""

    name: str
    variables: tuple[Variable, ...]
    on_entry: tuple[Statement, ...]
    on_exit: tuple[Statement, ...]
    internal: tuple[Statement, ...]
    on_suspend: tuple[Statement, ...]
    on_resume: tuple[Statement, ...]
    transitions: tuple[Transition, ...]
    span: Span
    stays: bool = False
    """It has no transitions, and the machine does not finish in it: its `internal` action runs turn after turn."""
    runs: tuple[str, ...] = ()
    """The machine instances that run while the machine is in this state, and only then."""

    @property
    def finishes(self) -> bool:
        """A machine finishes in it."""
        return not self.transitions and not self.stays


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine *instance*, its parameters already applied."""

    name: str
    kind: str
    """The name of the machine file's machine (several instances share it)."""
    variables: tuple[Variable, ...]
    states: tuple[State, ...]
    initial: int
    suspend: int | None
    """The declared suspend state, or the isolated one named `Suspend`; None: the implicit `__suspend`."""
    suspended: bool
    """It starts suspended."""
    span: Span
    model: bool = False
    """It stands for something else, and may choose: it is never run outside simulation."""
    loaded: bool = True
    """False: it is of the pool, and runs when it is loaded."""
    nested: bool = False
    """A state of another machine runs it."""
    on_fault: OnFault = "end"
    """What a fault in its ringlet does: it ends the run, or unloads the machine."""
    request: Request | None = None
    """Of a plant that is the other side of one: what a port needs to know of it."""
    knowledge: Mapping[str, LetIn] = field(default_factory=dict)
    """What its theories say, by the names of the entries."""

    @property
    def actions(self) -> tuple[tuple[Statement, ...], ...]:
        """Those of all states, in order."""
        return tuple(getattr(state, kind) for state in self.states for kind in ACTION_KINDS)

    def writes(self) -> Iterator[tuple[str, Span]]:
        """The stores to variables of the whiteboard in its text, each with its place."""
        for node in of_kind(self.actions, Assign):
            if isinstance(node.target, Read) and node.target.variable.scope == "whiteboard":
                yield node.target.variable.name, node.span

    def commands(self) -> Iterator[Command]:
        """The commands in its text."""
        return of_kind(self.actions, Command)

    def has_refusals(self, access: Access) -> bool:
        """Whether something that its text does is refused when it runs."""
        written = any(not access.may_write(self.name, variable) for variable, _ in self.writes())
        return access.refuses and (
            written or any(not access.may_command(self.name, c.kind, c.machine) for c in self.commands())
        )


@dataclass(frozen=True, slots=True)
class DeclaredType:
    """A type of the arrangement, by its name."""

    name: str
    span: Span
    named_in: frozenset[str]
    """The types in whose declarations the name stands; "": a variable or a parameter is declared with it."""


@dataclass(frozen=True, slots=True)
class WhiteboardVariable:
    """A variable of the whiteboard, and who writes it."""

    variable: Variable
    role: Role
    changes: Changes
    """How often the environment may change an input; `step` for everything else."""
    free: bool
    """A `changes: never` input without `init`: any value of its type, chosen before the run."""
    driven: bool = False
    """An input that the model of the surroundings writes."""
    safe: Value | None = None
    """What a run leaves in an output when it is stopped, fails or dies; no step depends on it."""


@dataclass(frozen=True, slots=True)
class Profile:
    """The differences between the published systems (docs/semantics.md, Profiles)."""

    base: Base
    snapshot: Snapshot
    """When inputs are sampled: each read by itself, before on_entry, after on_entry, once a cycle."""
    self_transition_restarts_clock: bool
    restart_enters_initial: bool
    """A restart of a machine that is in its initial state runs on_entry again."""
    commands: Commands


ENVIRONMENT = "env"
"""What a model of the surroundings without a name is called in properties."""

PROFILES: dict[str, Profile] = {
    "llfsm": Profile("llfsm", "ringlet", False, True, "next_turn"),
    "clfsm": Profile("clfsm", "none", False, True, "next_turn"),
    "swiftfsm": Profile("swiftfsm", "ringlet", True, False, "end_of_ringlet"),
}


@dataclass(frozen=True, slots=True)
class Suppression:
    """Findings `code` whose place is between the characters `start` and `end` of the file of `span` are accepted."""

    code: str
    reason: str
    span: Span
    """Of the code in the file."""
    start: int
    end: int
    whole: bool = False
    """It stands in the arrangement's own keys: it suppresses findings in every file."""

    def covers(self, code: str, place: Span | None) -> bool:
        """Whether a finding at `place` is accepted."""
        if code != self.code:
            return False
        if self.whole:
            return True
        return place is not None and place.source is self.span.source and self.start <= place.start < self.end


OperatorKind = Literal[
    "suspend", "resume", "restart", "enter", "load", "unload", "load_suspended", "write", "replace", "policy"
]
REPLACE: OperatorKind = "replace"
"""Another machine takes the place of a running one. No step does that, so no step program knows of it."""
POLICY: OperatorKind = "policy"
"""Another policy takes the place of the one in force. Its targets are the users who may do that."""
BETWEEN_STEPS = (REPLACE, POLICY)
"""What no step does."""


@dataclass(frozen=True, slots=True)
class Operator:
    """What people or other programs may do to a running arrangement: a command to a machine, or a write."""

    kind: OperatorKind
    target: str
    """A machine, a variable of the whiteboard, or of `policy` a user."""
    span: Span


@dataclass(frozen=True, slots=True)
class Process:
    """Machine instances that take turns."""

    name: str
    schedule: tuple[str, ...]
    """Machine instances in the order of their turns, those of the pool last."""
    span: Span
    pool: tuple[str, ...] = ()
    """Those that are not loaded at first."""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A validated arrangement: machine instances, what they share, and how they run."""

    name: str
    path: str
    """The file it came from, as the user named it (``<stdin>`` for standard input)."""
    digest: str
    """SHA-256 (hex) over the arrangement file and the machine files it names, in order."""
    profile: Profile
    observe: Observe
    timing: Timing
    cycle_ms: Fraction | None
    finished: Finished
    fairness: Fairness
    types: dict[str, Type]
    enumerations: tuple[EnumType, ...]
    tables: Mapping[str, Table]
    whiteboard: tuple[WhiteboardVariable, ...]
    machines: tuple[Machine, ...]
    """All instances, in the order of the processes' schedules."""
    processes: tuple[Process, ...]
    warnings: tuple[Diagnostic, ...]
    span: Span
    suppressions: tuple[Suppression, ...] = ()
    """Findings of `llfsm lint` that the files accept."""
    plants: tuple[Machine, ...] = ()
    """The models of the surroundings: their ringlets begin every cycle in this order, and each alone writes the inputs
    that it mentions on the left."""
    operators: tuple[Operator, ...] = ()
    """What operators may do that a step can show."""
    replaceable: tuple[Operator, ...] = ()
    """Which machines they may replace by others while it runs."""
    policy_users: tuple[Operator, ...] = ()
    """Who may change the policy while it runs."""
    access: Access | None = None
    """Who may do what; None: all may do everything."""
    declared_types: tuple[DeclaredType, ...] = ()
    """The names in `types`, and where they stand in declarations."""
    knowledge: Mapping[str, LetIn] = field(default_factory=dict)
    """What theories say, by the names of the entries."""
    kept_as: str | None = field(default=None, init=False, compare=False, repr=False)
    """The name under which it is kept for later runs; a copy with other parts has none."""

    @property
    def operated(self) -> tuple[Operator, ...]:
        """All that `operators` declares."""
        return (*self.operators, *self.replaceable, *self.policy_users)

    @property
    def texts(self) -> tuple[Machine, ...]:
        """All machines, the models of the surroundings included."""
        return (*self.machines, *self.plants)

    @property
    def surroundings(self) -> tuple[str, ...]:
        """The names of the models of the surroundings."""
        return tuple(plant.name for plant in self.plants)

    def machine(self, name: str) -> Machine:
        """The instance called `name`, or a model of the surroundings; KeyError: it has no such machine."""
        for machine in self.texts:
            if machine.name == name:
                return machine
        raise KeyError(name)
