"""The words of a lowering: control values, names of outputs, scalars of inputs, machines' controls, held samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from llfsm_verify.arrangement.model import Machine, State
from llfsm_verify.language.typed import Expression
from llfsm_verify.program.program import BOOL, Emit, EventKind, Expr, Get, Int

SUSPEND, RESUME, RESTART, ENTER = 1, 2, 3, 4
"""Values of a machine's pending slot; 0: it is empty; `ENTER` + n: an operator lets it enter its state n."""
COMMANDS = {"suspend": SUSPEND, "resume": RESUME, "restart": RESTART}
RAN, CYCLE, FIRED, SPENT = "$ran", "$cycle", "$fired", "$spent"
"""The outputs every step has; no name of a user begins so."""
FIRST = "$first"
"""The variable that is true until the first letter after the initial one."""
KNOWN = "known:"
"""How the locals begin in which a letter has the definitions of what theories say."""

Key = tuple[object, ...]


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
    """By state: the tick at which a timed clock stops; 0: nothing reads it there."""
    due_reads_clock: bool
    """Some on_suspend or on_resume action reads the clock, so it matters before `on_entry` too."""
    absents: bool = False
    """It can be absent from the schedule: it is of the pool, or a command may unload it."""
    keeps: bool = False
    """It stays in the schedule when it is finished."""
    owned: tuple[str, ...] = ()
    """The machines that its states run."""
    reloads: bool = False
    """A command may load it, so that it matters whether it has finished."""
    enters: bool = False
    """An operator may let it enter each of its states."""
    scheduled: bool = True
    """False: it is the model of the surroundings, whose ringlets are not steps."""

    def var(self, what: str) -> str:
        return f"{self.machine.name}.${what}"

    @property
    def state(self) -> Get:
        return Get(self.var("state"), None, Int(0, len(self.states) - 1))

    @property
    def waiting(self) -> Get:
        """Its pending slot."""
        most = ENTER + len(self.machine.states) - 1 if self.enters else RESTART
        return Get(self.var("pending"), None, Int(0, most))

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


@dataclass(frozen=True, slots=True)
class Held:
    """A hidden variable that every sample of the input `source` by `machine` ("": by any) brings up to date."""

    machine: str
    source: str
    variable: str
    value: Expression
    """What it holds: the truth of a condition over samples of the input, or one scalar of it."""
    scalars: tuple[str, ...]
    """The scalars of the input that are needed for it."""


@dataclass(frozen=True, slots=True)
class Samples:
    """What the atoms of one lowering ask of samples."""

    held: tuple[Held, ...] = ()
    truths: Mapping[Key, str] = field(default_factory=dict)
    """Where the truth of a condition is held, by `key_of`."""
    readers: tuple[tuple[str, str], ...] = ()
    """Machine and input of each `m.read(x)`."""

    def of(self, machine: str, source: str) -> list[Held]:
        """What a sample of `source` by `machine` changes."""
        return [h for h in self.held if h.source == source and h.machine in ("", machine)]

    def concern(self, machine: str) -> list[str]:
        """The inputs of which samples by `machine` matter."""
        mine = [h.source for h in self.held if h.machine in ("", machine)]
        return list(dict.fromkeys([*mine, *(x for m, x in self.readers if m == machine)]))
