"""What the names in a guard or an action may stand for, with suggestions for those that stand for nothing."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import LetIn, Variable
from llfsm_verify.language.types import DecimalType, EnumType, RangeType, ScalarType, Type

IMPLICIT_SUSPEND = "__suspend"
"""The name of the empty suspend state of a machine that has none of its own."""

ALL_DONE = "all_done"
"""In a state that runs machines: each of them is done. A variable may also have this name."""
FUNCTIONS = ("abs", "min", "max", "after", "after_ms", "is_running", "is_suspended")
ROUNDING = ("floor", "ceil", "round", "sqrt")
"""Functions of decimals. A variable may also have one of these names."""
COMMANDS = ("suspend", "resume", "restart", "load", "unload", "load_suspended", "suspend_all")
CALLS = {
    **{name: f"{name}(a)" for name in ("abs", *ROUNDING)},
    **{name: f"{name}(a, b)" for name in ("min", "max")},
    **{name: f"{name}(m)" for name in (*COMMANDS, "is_running", "is_suspended", "done", "refused", "faulted")},
    **{name: f"{name}(p)" for name in ("rose", "fell", "changed")},
    "after": "after(s)", "after_ms": "after_ms(ms)", "suspend_all": "suspend_all()",
    "fired": "m.fired(STATE, 0)", "entered": "m.entered(STATE)", "read": "m.read(x)", "sampled": "sampled(x)",
}  # fmt: skip
"""How each function is called."""
ELSEWHERE = frozenset(("sin", "cos", "tan", "atan", "atan2", "asin", "acos", "exp", "log", "pow", "trunc"))
"""Functions of other languages' libraries, which stand for none of ours."""
DECIMAL_NAMES = frozenset(("float", "double", "decimal", "real", "number", "fixed"))
DECIMAL_TYPE = "declare a type `{decimal: 0.01, range: -1.0..1.0}` under `types`, and write its name"
"""What to write instead of these."""
CHOOSE = "choose"
"""The function of models, whose value is any of those that are listed."""

TYPE_NAMES = ("bool", "int", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
_WORDS = ("and", "or", "not", "true", "false", "if", "else", "for", "in", "self", "array", "record", "refused")
RESERVED = frozenset((*_WORDS, IMPLICIT_SUSPEND, *FUNCTIONS, *COMMANDS, CHOOSE, *TYPE_NAMES))
"""Words that cannot name a variable, machine, state, type or enumerator."""

NO_MACHINES = (
    "the model of the surroundings does not see machines",
    "let the machine set a variable on the whiteboard, and read that",
)
"""E156 where a plant names a machine, and its hint."""

STEP_WORDS = frozenset(("cycle",))
"""Words that cannot name a whiteboard variable: they speak of the last step of a run."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant parameter's value."""

    value: int | bool
    type: ScalarType


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers that are looked up by their place, which counts from 0; those of decimals in steps."""

    name: str
    values: tuple[int, ...]
    type: RangeType | DecimalType
    span: Span
    """Where its name is declared."""


@dataclass(frozen=True, slots=True)
class MachineSignature:
    """What others may know of a machine instance: its states in order and the number of the suspend state, if any."""

    name: str
    states: tuple[str, ...]
    suspend: int | None
    nested: bool | None = None
    """Whether a state of another machine runs it; None: that is not known yet."""

    def state(self, name: str) -> int | None:
        """The number of the state called `name` (-1: the implicit suspend state), None when no state is called so."""
        if name in self.states:
            return self.states.index(name)
        return -1 if name == IMPLICIT_SUSPEND and self.suspend is None else None


@dataclass(frozen=True, slots=True)
class Scope:
    """The names that the text of one state of one machine instance can use."""

    variables: Mapping[str, Variable]
    constants: Mapping[str, Constant]
    machines: Mapping[str, MachineSignature]
    """Parameters that stand for machines, and all instances, by the name used in the text."""
    others: tuple[str, ...]
    """All other machine instances, in the order of the schedule."""
    self_name: str
    types: Mapping[str, Type]
    enumerators: Mapping[str, tuple[EnumType, ...]]
    inputs: frozenset[str]
    """Names of the variables that only the environment may write."""
    chooses: bool = False
    """The text is of a model, so it may say `choose(…)`."""
    surroundings: bool = False
    """The text is of a model of the surroundings: it writes inputs and its own variables, and sees no machines."""
    runs: tuple[str, ...] = ()
    """The machine instances that the state runs."""
    unseen: tuple[str, ...] = ()
    """The models of the surroundings, which machines do not see."""
    tables: Mapping[str, Table] = field(default_factory=dict)
    knowledge: Mapping[str, LetIn] = field(default_factory=dict)
    """What theories say, by the names it has here; the same place stands for all of an entry."""
    integer_guards: bool = False
    """Read an integer where a bool is expected as `!= 0` (texts of other tools that follow C)."""


def enumerators_of(types: Iterable[Type]) -> dict[str, tuple[EnumType, ...]]:
    """Each enumerator's name with the enumerations it belongs to."""
    found: dict[str, tuple[EnumType, ...]] = {}
    for enumeration in dict.fromkeys(t for t in types if isinstance(t, EnumType)):
        for value in enumeration.values:
            found[value] = (*found.get(value, ()), enumeration)
    return found


def _likeness(name: str, other: str) -> float:
    return difflib.SequenceMatcher(None, name, other).ratio()


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """A hint that names up to three of `known` that look like `name`, or all of them when they are few."""
    names = list(dict.fromkeys(known))
    near = near_names(name, names)
    return near or (f"known here: {', '.join(f'`{n}`' for n in names)}" if 0 < len(names) <= 6 else None)


def near_names(name: str, names: list[str]) -> str | None:
    """A hint that names up to three of `names` that look like `name`. Of names that differ in case only, the one that
    is closest to `name` counts, or else the first."""
    lowered: dict[str, list[str]] = {}
    for each in names:
        lowered.setdefault(each.lower(), []).append(each)
    near = difflib.get_close_matches(name[:100].lower(), list(lowered)[:2000], n=3, cutoff=0.6)
    if near:
        closest = (max(lowered[n], key=lambda each: _likeness(name[:100], each)) for n in near)
        return "did you mean " + " or ".join(f"`{each}`" for each in closest) + "?"
    return None
