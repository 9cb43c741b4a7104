"""The step program: the small typed imperative program that an arrangement means, and that every engine consumes.

A *configuration* gives a value to every persistent `Var`. All values are Python ints (bools are 0 and 1, enumerators
their index). A *step* is one ringlet of one process, or the stuttering step of an arrangement that has ended:

    step(configuration, process, choices):
        if observe == "ringlet" or the output `cycle` of the previous step was 1 (it is in the beginning):
            every output variable := its init                # outputs live beside the configuration
        slot = the process's slots[value of process.turn]
        run slot.prologue
        run slot.blocks[value of slot.state]                 # one of them, chosen after the prologue
        run slot.epilogue                                    # acceptance, commands that act at once
        run process.epilogue                                 # next turn, cycle, clocks, end
        run slot.canonical                                   # dead variables to fixed values
        run letter                                           # samples what properties mention, sets their outputs
    stutter(configuration, choices): outputs := init; run letter_stutter

A process may step while its `ended` variable is 0 (`ended` None: always). When no process may, only `stutter` is left,
forever. Blocks are loop-free and total: a `Fault` that holds ends the run there, with no successor. Nothing but
`Sample` and the choice of the process is nondeterministic. Locals belong to one block (`prologue`, one of `blocks`, …)
and do not survive it; every local is assigned on each path before it is read.

Arithmetic is exact. An `Op` whose exact interval fits in 128 bits, with a sign or without, has a type
`Int(low, high)`; variables and choices fit in 64. An operation on values that nothing bounds is `Unbounded`, and so are
its operands then: an engine that holds them in 64 bits must end the run with *unknown* when one leaves them
(docs/decisions/0038-128-bits-on-the-way.md).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from llfsm_verify.diagnostics import Span

INT64_MIN, INT64_MAX = -(1 << 63), (1 << 63) - 1


@dataclass(frozen=True, slots=True)
class Int:
    """The integers `low` … `high`. For printing: Bool is Int(0, 1) with a flag, and a decimal is the number of its
    steps of ``10 ** -digits``."""

    low: int
    high: int
    boolean: bool = False
    digits: int = 0


@dataclass(frozen=True, slots=True)
class Unbounded:
    """All integers (see the module's last paragraph)."""


Type = Int | Unbounded
BOOL = Int(0, 1, True)
UNBOUNDED = Unbounded()


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a variable comes from, for printing: `labels` name the values low, low + 1, … (enumerators, states)."""

    kind: Literal["whiteboard", "machine", "state", "input", "control", "output"]
    machine: str = ""
    labels: tuple[str, ...] = ()
    pattern: str = ""
    """Of an array: how users write an element, ``a[{}][{}].x``, with an index for each of `shape`."""
    shape: tuple[int, ...] = ()
    about: str = ""
    """Of a hidden variable: what properties say that it stands for, as it is written there."""


@dataclass(frozen=True, slots=True)
class Var:
    """A variable. `length` None: a scalar and `init` its value; else an array of that many elements, `init` a tuple."""

    name: str
    type: Type
    init: int | tuple[int, ...]
    origin: Origin
    length: int | None = None
    output: bool = False
    """A step output: not part of the configuration."""
    free: bool = False
    """Any value of its type in the initial configurations (`init` is then only an example)."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A source of nondeterminism: sampled at most once a step, later `Sample`s of it in the step give the same value.

    `input` is the scalar input a choice of kind `input` or `read` samples ("" for others). Under snapshot profiles an
    input has one choice of kind `input`; with `snapshot: none` each evaluated read has one of kind `read`. A model's
    `choose(…)` has one of kind `choose` each time it is evaluated.
    """

    name: str
    type: Int
    kind: Literal["input", "read", "age", "choose"]
    input: str
    labels: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """What users call it: its input, or its own name where it has none."""
        return self.input or self.name


@dataclass(frozen=True, slots=True)
class Input:
    """A scalar input that is not stored in the configuration, with its value in the first letter (`init`)."""

    name: str
    type: Int
    init: int
    labels: tuple[str, ...] = ()


# ---------------------------------------------------------------- expressions: pure and total


@dataclass(frozen=True, slots=True)
class Const:
    """A number, or a truth value as 0 or 1."""

    value: int
    type: Type


@dataclass(frozen=True, slots=True)
class Get:
    """The value of variable `var` (of its element `index`, which earlier statements have checked)."""

    var: str
    index: Expr | None
    type: Type


@dataclass(frozen=True, slots=True)
class Local:
    """The value of a local."""

    name: str
    type: Type


OpName = Literal[
    "add", "sub", "mul", "div", "mod", "neg", "abs", "min", "max",
    "eq", "ne", "lt", "le", "gt", "ge", "not", "and", "or", "xor", "wrap",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Op:
    """An operation on already evaluated arguments. `div` and `mod` truncate towards zero as in C, their divisor is not
    zero (checked before); `and`, `or`, `not`, `xor` are on 0 and 1; `wrap` brings its argument into its own type
    `Int(low, high)`, whose size is a power of two, modulo that size (two's complement)."""

    op: OpName
    args: tuple[Expr, ...]
    type: Type


@dataclass(frozen=True, slots=True)
class Ite:
    """One of two values; only the chosen one is evaluated."""

    condition: Expr
    then: Expr
    otherwise: Expr
    type: Type


Expr = Const | Get | Local | Op | Ite


# ---------------------------------------------------------------- statements


@dataclass(frozen=True, slots=True)
class Set:
    """Store: the value is inside the variable's type (checked or wrapped before)."""

    var: str
    index: Expr | None
    value: Expr


@dataclass(frozen=True, slots=True)
class Let:
    """Assign a local (a local may be assigned in several branches, always with one type)."""

    local: Local
    value: Expr


@dataclass(frozen=True, slots=True)
class Sample:
    """Read a choice into a local; records that this step has read it, in order of first reading."""

    local: Local
    choice: str


@dataclass(frozen=True, slots=True)
class If:
    """Run one of two blocks."""

    condition: Expr
    then: Block
    otherwise: Block = ()


@dataclass(frozen=True, slots=True)
class Switch:
    """The block of the case equal to the value, else `default`."""

    value: Expr
    cases: tuple[tuple[int, Block], ...]
    default: Block = ()


@dataclass(frozen=True, slots=True)
class Fault:
    """When the condition holds the step has no successor: fault number `fault` of `Program.faults`."""

    fault: int
    when: Expr


EventKind = Literal[
    "entry", "exit", "internal", "on_suspend", "on_resume", "guard", "suspend", "resume", "restart", "accept", "load",
    "unload", "faulted", "refused", "part", "enter",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Emit:
    """Tell observers what happens. Engines that are not observed leave it out.

    `machine` is an index into `Program.machines`. Arguments: (state) for entry, exit, internal, on_suspend, on_resume
    and accept; (state, transition, value) for guard; (from, to) for suspend, resume and enter, (from) for restart, none
    for load and unload; the number of the place, in `Program.faults` for faulted, in `Program.refusals` for refused;
    (part, value) for part, which only programs have that tell the parts of guards (`semantics.parts`).
    """

    kind: EventKind
    machine: int
    args: tuple[Expr, ...]


Stmt = Set | Let | Sample | If | Switch | Fault | Emit
Block = tuple[Stmt, ...]


# ---------------------------------------------------------------- the program


@dataclass(frozen=True, slots=True)
class FaultSite:
    """One place where a step can fault, or is refused something: the diagnostic's code, what to say, and the source."""

    code: str
    message: str
    span: Span | None
    variable: str = ""
    """Of a value outside its range: what was to hold it, as written."""


@dataclass(frozen=True, slots=True)
class TransitionInfo:
    """A transition, for traces: the index of its target, and its guard as written."""

    target: int
    text: str
    span: Span | None


@dataclass(frozen=True, slots=True)
class MachineInfo:
    """Names for printing: the states (an implicit suspend state included) and their transitions."""

    name: str
    states: tuple[str, ...]
    transitions: tuple[tuple[TransitionInfo, ...], ...]
    suspend: int | None = None
    """The number of the suspend state, where there is one."""

    def transition_text(self, state: int, number: int) -> str:
        """A transition as traces write it: ``RED -> GREEN when car``."""
        taken = self.transitions[state][number]
        return f"{self.states[state]} -> {self.states[taken.target]} when {taken.text}"


@dataclass(frozen=True, slots=True)
class Slot:
    """One machine's place in a schedule. `state` names the variable that selects one of `blocks`."""

    machine: int
    process: int
    state: str
    prologue: Block
    blocks: tuple[Block, ...]
    epilogue: Block
    canonical: Block


@dataclass(frozen=True, slots=True)
class Process:
    """`slots` are indices into `Program.slots` in the order of turns; `turn` names the variable that counts in them."""

    name: str
    slots: tuple[int, ...]
    turn: str
    ended: str | None
    epilogue: Block


@dataclass(frozen=True, slots=True)
class Fairness:
    """A run is fair when: `premise` infinitely often implies `goal` infinitely often. Both name Bool output variables;
    premise None is true."""

    name: str
    premise: str | None
    goal: str


@dataclass(frozen=True, slots=True)
class Atom:
    """A state formula a property mentions: the Bool output variable `output` shows it in every letter but the first,
    which evaluates `expression` over the initial configuration, the outputs' inits and the inputs' inits."""

    name: str
    output: str
    expression: Expr
    """Over persistent variables, outputs and, as `Local("input:NAME", …)`, unstored inputs."""


@dataclass(frozen=True, slots=True)
class Program:
    """An arrangement, lowered. `observe` says which steps have a letter: each, or those whose output `cycle` is 1 (and
    stuttering steps)."""

    name: str
    observe: Literal["ringlet", "cycle"]
    vars: tuple[Var, ...]
    choices: tuple[Choice, ...]
    inputs: tuple[Input, ...]
    machines: tuple[MachineInfo, ...]
    slots: tuple[Slot, ...]
    processes: tuple[Process, ...]
    letter: Block
    letter_stutter: Block
    atoms: tuple[Atom, ...]
    fairness: tuple[Fairness, ...]
    faults: tuple[FaultSite, ...]
    ran: str = field(default="ran")
    """Output variable: 1 + the index of the slot that ran last (0: none)."""
    cycle: str = field(default="cycle")
    """Output variable: the step completed a cycle of its process."""
    fired: str = field(default="fired")
    """Output variable: 0, or 1 + the number of the transition that fired in its state."""
    spent: str = field(default="spent")
    """Output variable: the state, of the machine that ran, in which its ringlet was spent."""
    refusals: tuple[FaultSite, ...] = ()
    """The places where a machine is refused what it may not do."""
    period: Fraction | None = None
    """Milliseconds of logical time that a cycle takes; None: the arrangement is untimed, or it is not said."""
    kept_as: str | None = field(default=None, init=False, compare=False, repr=False)
    """The name under which it is kept for later runs; a copy with other parts has none."""
