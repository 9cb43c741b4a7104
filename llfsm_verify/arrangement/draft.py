"""Drafts: an arrangement and its machines as written, before anything in them is resolved or checked.

A reader of a format makes a draft, and `resolve` makes the model of it. The draft has the structure; a word, a type or
a value in it is a `Node` as it is written, since what is wrong with it is for the resolver to say:

- a name, a word or a number is a `Scalar`; a guard or an action is a `Scalar` with the text in our language;
- a type is a `Scalar` (`bool`, `0..15`, a name), a `Mapping` with `array` and `size`, or with `record`; an enumeration
  is a `Sequence` of its values;
- an initial value or an argument is a `Scalar`, or a `Sequence` or `Mapping` of them.

`written` and `implied` (`nodes.py`) make scalars by hand. None stands for what the file does not say. Fields of type
`Node | None` are called as documents call their keys, and readers of documents fill them by that.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping as MappingABC
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from llfsm_verify.arrangement.model import ActionKind
from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar


@dataclass(frozen=True, slots=True)
class Unreadable:
    """A part that its reader could not read. An error in the draft says why, so no more is said of it."""


UNREADABLE = Unreadable()

Entry = tuple[Scalar, Node]
"""A name and what stands under it."""


@dataclass(frozen=True, slots=True)
class Lint:
    """Findings of lint that a part accepts."""

    node: Node
    """A mapping from their codes to reasons."""
    extent: Span
    """The part: findings between its first and its last character are accepted."""


@dataclass(frozen=True, slots=True)
class VariableDraft:
    """A variable of a machine or of one of its states."""

    name: Scalar
    type: Node | Unreadable
    init: Node | None = None
    lint: Lint | None = None


@dataclass(frozen=True, slots=True)
class KnowledgeDraft:
    """What a theory says under a name."""

    name: Scalar
    theory: Source | Unreadable
    """The text of the theory."""
    file: Scalar | None = None
    """Where the theory is named; None: it is unreadable."""
    inputs: tuple[Entry, ...] = ()
    """A condition for each input that is not a variable of its name."""
    output: Node | None = None
    """One of the theory's, where it is not called as the entry, or the only one."""


@dataclass(frozen=True, slots=True)
class WhiteboardDraft:
    """A variable that machines share."""

    name: Scalar
    type: Node | Unreadable
    init: Node | None = None
    role: Node | None = None
    changes: Node | None = None
    lint: Lint | None = None
    safe: Node | None = None


@dataclass(frozen=True, slots=True)
class ParameterDraft:
    """What an instance of a machine has to be given."""

    name: Scalar
    kind: Literal["whiteboard", "machine", "constant"] | Unreadable
    type: Node | None = None
    """None for a machine."""


@dataclass(frozen=True, slots=True)
class TransitionDraft:
    """A transition of a state, tried in the order of its list."""

    guard: Scalar | Unreadable
    target: Node
    """The name of a state."""
    lint: Lint | None = None


@dataclass(frozen=True, slots=True)
class StateDraft:
    """A state of a machine, with the texts of its actions."""

    name: Node
    variables: tuple[VariableDraft, ...] = ()
    actions: MappingABC[ActionKind, Scalar] = field(default_factory=dict)
    transitions: tuple[TransitionDraft, ...] = ()
    lint: Lint | None = None
    stays: Node | None = None
    """`true`: the machine does not finish in it, although it has no transitions."""
    runs: Node | None = None
    """The instances that only this state runs."""


@dataclass(frozen=True, slots=True)
class MachineDraft:
    """A machine as one file, or one mapping, describes it."""

    name: Node
    states: tuple[StateDraft, ...] | Unreadable
    states_at: Span
    """Where its states are listed."""
    parameters: tuple[ParameterDraft, ...] = ()
    variables: tuple[VariableDraft, ...] = ()
    knowledge: tuple[KnowledgeDraft, ...] = ()
    initial: Node | None = None
    """The name of a state; the first one where it is None."""
    suspend: Node | None = None
    lint: Lint | None = None
    instead: Diagnostic | None = None
    """Said instead of all errors in its text, if there are any: the file does not look like a machine at all."""


@dataclass(frozen=True, slots=True)
class InstanceDraft:
    """An instance of a machine, with arguments for its parameters."""

    name: Scalar
    machine: MachineDraft | Unreadable
    """The same object for all instances of one machine file."""
    arguments: tuple[Entry, ...] = ()
    suspended: Node | None = None
    model: Node | None = None
    """`true`: it stands for something else, and may choose."""
    on_fault: Node | None = None
    """`unload`: a fault in its ringlet unloads it."""


@dataclass(frozen=True, slots=True)
class PlantDraft:
    """A model of the surroundings that is there already."""

    name: Scalar
    keys: Mapping
    """`use`, its name, and what it asks for."""


@dataclass(frozen=True, slots=True)
class ProcessDraft:
    """Machines that take turns."""

    name: Scalar | None
    """None: the only process, `main`."""
    slots: Node
    """A sequence of names of instances, in the order of their turns."""
    pool: Node | None = None
    """A sequence of names of those that are not loaded at first."""


@dataclass(frozen=True, slots=True)
class ArrangementDraft:
    """An arrangement and all that its file says of it."""

    name: Node | str
    span: Span
    """Where it begins: what is missing in it is said there."""
    machines: tuple[InstanceDraft, ...] | Unreadable
    processes: tuple[ProcessDraft, ...] | Unreadable
    types: tuple[Entry, ...] = ()
    tables: tuple[Entry, ...] = ()
    """Names, each with a sequence of numbers."""
    whiteboard: tuple[WhiteboardDraft, ...] = ()
    knowledge: tuple[KnowledgeDraft, ...] = ()
    profile: Node | None = None
    """The name of a profile, or a mapping of `base` and what differs from it."""
    observe: Node | None = None
    timing: Node | None = None
    cycle_ms: Node | None = None
    finished: Node | None = None
    fairness: Node | None = None
    lint: Lint | None = None
    plants: tuple[InstanceDraft | PlantDraft, ...] = ()
    """The models of the surroundings, in the order of their ringlets."""
    access: Node | Unreadable | None = None
    """Levels, and which machine, variable, command and user has which."""
    operators: Node | None = None
    """A mapping of commands, and `write`, to the machines and variables that operators may use them on."""


@dataclass(frozen=True, slots=True)
class Draft:
    """What a reader makes of an arrangement and all files that it names."""

    arrangement: ArrangementDraft | Unreadable
    path: str
    """The file, as the user named it."""
    digest: str
    """SHA-256 (hex) over all that was read, in order."""
    sources: tuple[Source, ...]
    """All texts that were read, in the order in which their mistakes are shown."""
    files: tuple[Path, ...] = ()
    """The files that it names, also those that cannot be read."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """What the reader found wrong."""
    instead: Diagnostic | None = None
    """Said instead of all errors, if there are any: the file does not look like an arrangement at all."""


def has_unreadable(draft: ArrangementDraft) -> bool:
    """Whether a part is missing that the reader could not read."""
    return any(isinstance(part, Unreadable) for part in _parts(draft))


def _parts(draft: ArrangementDraft) -> Iterator[object]:
    """All parts that may be unreadable."""
    yield from (draft.machines, draft.processes)
    yield from (variable.type for variable in draft.whiteboard)
    yield from (entry.theory for entry in draft.knowledge)
    instances = () if isinstance(draft.machines, Unreadable) else draft.machines
    instances = (*instances, *(plant for plant in draft.plants if isinstance(plant, InstanceDraft)))
    yield from (instance.machine for instance in instances)
    for machine in {id(i.machine): i.machine for i in instances if isinstance(i.machine, MachineDraft)}.values():
        yield machine.states
        yield from (parameter.kind for parameter in machine.parameters)
        yield from (variable.type for variable in machine.variables)
        yield from (entry.theory for entry in machine.knowledge)
        for state in () if isinstance(machine.states, Unreadable) else machine.states:
            yield from (variable.type for variable in state.variables)
            yield from (transition.guard for transition in state.transitions)
