"""The keys of arrangements, machines and policies, and what people write in their place.

Each key is told once, in its table: the reader, the JSON Schemas and the words of hints have it from there.
"""

from __future__ import annotations

from typing import get_args

from llfsm_verify.arrangement import model
from llfsm_verify.arrangement.codes import HINTS
from llfsm_verify.arrangement.model import ACTION_KINDS, PROFILES, OperatorKind
from llfsm_verify.arrangement.plants import ACTION_KEYS, SERVICE_KEYS
from llfsm_verify.arrangement.suppressions import CODES, KEY
from llfsm_verify.yaml.fields import VERSION
from llfsm_verify.yaml.tables import (
    NAME,
    NUMBER,
    TRUTHS,
    ByName,
    Either,
    Field,
    Schema,
    Several,
    Shared,
    Single,
    Table,
    Words,
    schema_of,
)
from llfsm_verify.yaml.vocabulary import Vocabulary

MAX_ELEMENTS = 4096
"""Scalars in one value."""
MOST_NUMBERS = 1024
"""Numbers in one table: what is looked up is found by halving, which is written out at each place."""
_NAME, _TYPE, _VALUE, _MACHINE, _SUPPRESSED = map(Shared, ("name", "type", "value", "machine", "suppressions"))
_NAMES = Several(_NAME, different=False)
_LEVELS = ByName(_NAME, least=0)
_TRUTH = Words(TRUTHS)
_WORD = Single(("string", "boolean", "number"))
_TEXT = Single(("string",))
_NUMBER = Single(("number", "string"))
_FORMAT = Field(
    VERSION,
    "the format of the file. A version of llfsm-verify that knows only older ones says so",
    Words(("1",), texts=False),
)
_LINT = Field(KEY, "findings of `llfsm lint` that are accepted here, each with the reason", _SUPPRESSED)

# ---------------------------------------------------------------- types and variables

ARRAY = Table(
    "an array",
    (
        Field("array", "the type of the elements", _TYPE, required=True),
        Field("size", "the number of elements", Single(NUMBER.kinds, least=1, most=MAX_ELEMENTS), required=True),
    ),
)
DECIMAL = Table(
    "decimal numbers: the multiples of a step in a range",
    (
        Field("decimal", "the step, a power of ten: `0.1`, `0.01`, …", _NUMBER, required=True),
        Field("range", "the smallest and the largest number, such as `-1.0..1.0`", _TEXT, required=True),
    ),
)
RECORD = Table("a record", (Field("record", "the fields and their types", ByName(_TYPE, NAME), required=True),))
VARIABLE = Table(
    "a variable",
    (
        Field("type", "its type", _TYPE, required=True),
        Field(
            "init", "the initial value (else false, 0 or the first enumerator)", _VALUE, called="default value initial"
        ),
        _LINT,
    ),
)
_VARIABLES = ByName(Shared("variable"), NAME, least=0)
WHITEBOARD = Table(
    "a whiteboard variable",
    (
        *VARIABLE.fields[:2],
        Field(
            "role",
            "who writes it: the environment (`input`), machines for the environment (`output`), machines only "
            "(`shared`, the default)",
            Words(get_args(model.Role)),
        ),
        Field("changes", "how often the environment may change an input", Words(get_args(model.Changes))),
        Field("safe", "what a run leaves in an output when it is stopped, fails or dies", _VALUE),
        _LINT,
    ),
)

# ---------------------------------------------------------------- machines

TRANSITION = Table(
    "a transition",
    (
        Field(
            "when",
            "the guard, such as `after(3)`: true when strictly more than 3 s have passed since the first turn in the "
            "state. Quote it when it starts with `!`, `&`, `*`, `@`, `[` or `{`, or write `not` for `!`",
            Single(("string", "boolean")),
            required=True,
            called="if guard condition cond",
        ),
        Field("to", "the target state", _NAME, required=True, called="target goto then next dest destination"),
        _LINT,
    ),
)
_ACTION = Single(("string", "null"))
_ACTIONS = {
    "on_entry": ("runs when the state is entered (not on a self-transition)", "entry enter"),
    "on_exit": ("runs when a transition leaves the state", "exit leave"),
    "internal": ("runs in every ringlet in which no transition fires", "do during loop tick action body"),
    "on_suspend": ("runs when the machine is suspended in this state", ""),
    "on_resume": ("runs when the machine is resumed into this state", ""),
}
STATE = Table(
    "a state",
    (
        Field("name", "the state's name", _NAME, required=True, called="state id title"),
        Field(
            "variables", "variables that only this state sees; they keep their values", _VARIABLES, called="vars locals"
        ),
        *(Field(kind, _ACTIONS[kind][0], _ACTION, called=_ACTIONS[kind][1]) for kind in ACTION_KINDS),
        Field(
            "transitions",
            "in order: the first whose guard holds fires",
            Several(TRANSITION, least=0, different=False, empty=True),
        ),
        Field(
            "stays",
            "true: a state without transitions in which the machine does not finish; its `internal` action runs turn "
            "after turn",
            _TRUTH,
            called="final end terminal",
        ),
        Field(
            "runs",
            "the machines that run while the machine is in this state, and only then",
            Several(_NAME, least=0, different=False),
        ),
        _LINT,
    ),
)
KNOWLEDGE = Table(
    "a condition that a theory of plausible logic decides",
    (
        Field("file", "the theory (a `.d` file), relative to this file", _TEXT, required=True),
        Field(
            "inputs",
            "a condition for each input of the theory; without one it is the Boolean variable of its name",
            ByName(Single(("string", "boolean")), NAME, least=0),
        ),
        Field("output", "which of its outputs; else the one that is called as this entry, or the only one", _WORD),
    ),
)
_KNOWLEDGE = Field(
    "knowledge",
    "what theories say, by the names that guards, actions and properties have for it. Inputs may ask for what stands "
    "above",
    ByName(Shared("knowledge"), NAME, least=0),
    called="theories theory",
)
PARAMETER = Table(
    "a whiteboard variable or a constant",
    (
        Field("whiteboard", "a whiteboard variable of this type", _TYPE),
        Field("constant", "a constant of this type", _TYPE),
    ),
    one=("whiteboard", "constant"),
)
MACHINE = Table(
    "a logic-labelled finite-state machine",
    (
        _FORMAT,
        Field("machine", "the machine's name", _NAME, required=True, called="name id"),
        Field(
            "parameters",
            "parameters, given by each instance",
            ByName(Either((Words(("machine",)), PARAMETER)), NAME, least=0),
        ),
        Field("variables", "variables of the machine", _VARIABLES, called="vars locals"),
        _KNOWLEDGE,
        Field(
            "initial", "the initial state (the first one unless named)", _NAME, called="init start begin initial_state"
        ),
        Field("suspend", "the suspend state (else an isolated state `Suspend`, else an empty one)", _NAME),
        Field("states", "the states", Several(STATE, different=False), required=True),
        _LINT,
    ),
)

# ---------------------------------------------------------------- arrangements

_ARGUMENTS = ByName(Single((*_WORD.kinds, "null")), NAME, least=0)
ENVIRONMENT = Table(
    "the model of the surroundings: its ringlet begins every cycle, and it alone writes the inputs that it mentions on "
    "the left",
    (
        Field("file", "the machine's file, relative to this one", _TEXT),
        Field("inline", "the machine, written in place", _MACHINE),
        Field("parameters", "a whiteboard variable or a constant for each parameter", _ARGUMENTS),
    ),
    one=("file", "inline"),
)
USED = Table(
    "a plant that is there already, and what it needs",
    (Field("use", "which one", Single(("string",)), required=True),),
    variants={"service": SERVICE_KEYS, "action": ACTION_KEYS},
)
INSTANCE = Table(
    "a machine instance",
    (
        *ENVIRONMENT.fields[:2],
        Field("parameters", "a whiteboard variable, a machine or a constant for each parameter", _ARGUMENTS),
        Field("suspended", "the machine starts suspended", _TRUTH),
        Field(
            "on_fault",
            "`unload`: a fault in its ringlet unloads it, and the cycle goes on; else it ends the run",
            Words(get_args(model.OnFault)),
        ),
        Field("model", "the machine stands for something else, and may use `choose`", _TRUTH),
    ),
    one=("file", "inline"),
)
PROFILE = Table(
    "a profile with single choices changed",
    (
        Field("base", "the profile to start from", Words(tuple(PROFILES))),
        Field("snapshot", "when inputs are sampled", Words(get_args(model.Snapshot))),
        Field("self_transition_restarts_clock", "a self-transition restarts the state's clock", _TRUTH),
        Field("restart_enters_initial", "a restart in the initial state runs its on_entry again", _TRUTH),
        Field("commands", "when suspend, resume and restart act", Words(get_args(model.Commands))),
    ),
)
_OPERATORS: dict[OperatorKind, str] = {
    "suspend": "machines that operators may suspend",
    "resume": "machines that they may resume",
    "restart": "machines that they may restart",
    "enter": "machines that they may let enter any of their states",
    "load": "machines that they may load",
    "unload": "machines that they may unload",
    "load_suspended": "machines that they may load suspended",
    "write": "variables of the whiteboard that they may write",
    "replace": "machines that operators may replace by others while the arrangement runs",
    "policy": "users who may change the policy while the arrangement runs",
}
OPERATORS = Table(
    "what people and other programs may do to the running arrangement: commands to machines, and writes to variables "
    "of the whiteboard",
    tuple(
        Field(kind, about, Several(_NUMBER if kind == model.POLICY else _NAME, least=0, different=False))
        for kind, about in _OPERATORS.items()
    ),
)
POLICY = Table(
    "who may do what: levels, and which machine, variable, command and user has which",
    (
        Field("levels", "the levels, the lowest first", _NAMES, required=True),
        Field("machines", "the clearance of each machine; the lowest level where it is not named", _LEVELS),
        Field("write", "the clearance that a write of each variable needs", _LEVELS),
        Field("command", "the clearance that a command to each machine needs; its own where it is not named", _LEVELS),
        Field("users", "the clearance of people and programs outside", _LEVELS),
        Field(
            "on_violation",
            "`reject`: a text that does what it may not is an error. `refuse`: the write or command has no effect",
            Words(("reject", "refuse")),
        ),
    ),
)
POLICY_FILE = Table(
    "a policy in a file of its own",
    (Field("file", "the file with the policy, relative to this one", Single(("string",), r"[\s\S]"), required=True),),
)
ARRANGEMENT = Table(
    "machines, the whiteboard they share and the schedule in which they take turns",
    (
        _FORMAT,
        Field("name", "the arrangement's name (the file's name unless given)", _WORD),
        Field("profile", "which published system's semantics", Either((Words(tuple(PROFILES)), PROFILE))),
        Field(
            "observe",
            "what a step of a property is: one ringlet (the default) or one whole cycle",
            Words(get_args(model.Observe)),
        ),
        Field(
            "cycle_ms",
            "the period of a cycle in milliseconds; needed by `after` unless untimed. `after(3)` is true when strictly "
            "more than 3 s have passed",
            Single(_NUMBER.kinds, above=0),
            called="period tick step dt cycle",
        ),
        Field("timing", "`untimed` covers every real timing", Words(get_args(model.Timing))),
        Field(
            "finished", "whether a finished machine leaves the schedule (the default)", Words(get_args(model.Finished))
        ),
        Field(
            "fairness",
            "whether every live process takes infinitely many steps (the default)",
            Words(get_args(model.Fairness)),
        ),
        Field(
            "types",
            "named types; a list is an enumeration",
            ByName(Either((_NAMES, _TYPE)), NAME, least=0),
            called="enums enum",
        ),
        Field(
            "tables",
            "lists of numbers that texts look up, as in `sine[i]`",
            ByName(Several(_NUMBER, most=MOST_NUMBERS, different=False), NAME, least=0),
        ),
        Field(
            "whiteboard",
            "variables that all machines and the environment share",
            ByName(WHITEBOARD, NAME, least=0),
            called="variables vars globals shared inputs outputs",
        ),
        _KNOWLEDGE,
        Field("machines", "machine instances", ByName(INSTANCE, NAME, least=0), required=True, called="fsms fsm"),
        Field(
            "environment",
            f"{ENVIRONMENT.about}; or several, by their names",
            Either((ENVIRONMENT, ByName(Either((ENVIRONMENT, USED)), NAME))),
            called="plant surroundings",
        ),
        Field("schedule", "all machines in the order of their turns", _NAMES, called="order sequence"),
        Field("processes", "several processes, each with its own schedule", ByName(_NAMES, NAME)),
        Field(
            "pool",
            "the machines that are not loaded at first; their slots follow the schedule in this order. With several "
            "processes by process",
            Either((_NAMES, ByName(_NAMES, NAME))),
        ),
        Field("operators", OPERATORS.about, OPERATORS),
        Field("access", "who may do what, here or in a file of its own", Either((POLICY, POLICY_FILE))),
        _LINT,
    ),
    one=("schedule", "processes"),
)

SHARED = (
    Field("name", "a name: letters, digits and `_`, no digit first", Single(("string", "boolean", "null"), NAME)),
    Field(
        "type",
        "a type: `bool`, a range such as `0..15`, `int8` to `uint64`, `int`, the name of a type, decimals, an array or "
        "a record",
        Either(
            (
                Single(("string",), f"^(bool|u?int(8|16|32)|int|-?[0-9]+ *\\.\\. *-?[0-9]+|{NAME[1:-1]})$"),
                ARRAY,
                DECIMAL,
                RECORD,
            )
        ),
    ),
    Field(
        "value",
        "a value: a number, `true` or `false`, an enumerator, a constant expression, a list for an array, a mapping "
        "for a record",
        Either((Single((*_WORD.kinds, "null")), Several(_VALUE, least=0, different=False), ByName(_VALUE, least=0))),
    ),
    Field("variable", VARIABLE.about, VARIABLE),
    Field("machine", MACHINE.about, MACHINE),
    Field("knowledge", KNOWLEDGE.about, KNOWLEDGE),
    Field("suppressions", _LINT.about, ByName(_WORD, tuple(CODES), least=0, empty=True)),
)
"""What is described once for all places where it may stand."""


def schema(name: str) -> Schema:
    """The JSON Schema of the files that people write: `arrangement`, `machine` or `policy`."""
    policy = Table("who may do what in an arrangement (`access: {file: …}`)", (_FORMAT, *POLICY.fields))
    table = {"arrangement": ARRANGEMENT, "machine": MACHINE, "policy": policy}[name]
    return schema_of(name, f"{name.capitalize()} of llfsm-verify", table, SHARED)


_TABLES = (ARRANGEMENT, INSTANCE, WHITEBOARD, MACHINE, STATE, TRANSITION)
VOCABULARY = Vocabulary(
    keys=frozenset(key for table in _TABLES for key in table.keys),
    guards=("when",),
    actions=ACTION_KINDS,
    named=tuple({one.name: None for table in _TABLES for one in table.fields if isinstance(one.value, ByName)}),
    called={one.name: one.called for table in _TABLES for one in table.fields if one.called},
    elsewhere={
        "clearance": "the arrangement gives machines their clearance, under `access`",
        "plant": "write the model of the surroundings under `environment`",
        "model": "write `model` beside `file` or `inline`, where the arrangement names the machine",
        KEY: "`lint` is allowed in an arrangement, a machine, a state, a transition, and the declaration of a variable",
    },
    spelt={
        "action": "a transition has no action: write it under `on_exit` of this state, or `on_entry` of the next",
        "input": "write `role: input`",
        "output": "write `role: output`",
        "array": "write `type: {array: TYPE, size: N}`",
    },
    shapes={
        "a transition": "write `{when: …, to: STATE}`",
        "a state": "write `name: STATE`, and its other keys below",
        "`knowledge`": "write `NAME: {file: THEORY.d}`, one per line",
        "`machines`": "write `NAME: {file: NAME.machine.yaml}`, one per line",
        **dict.fromkeys(("`whiteboard`", "`variables`"), "write `NAME: {type: TYPE}`, one per line"),
    },
    hints=HINTS,
)
