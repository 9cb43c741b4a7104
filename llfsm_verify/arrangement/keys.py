"""The keys of arrangements and machines, and what people write in their place."""

from __future__ import annotations

from llfsm_verify.arrangement.codes import HINTS
from llfsm_verify.arrangement.model import ACTION_KINDS
from llfsm_verify.arrangement.suppressions import KEY
from llfsm_verify.yaml.fields import VERSION
from llfsm_verify.yaml.vocabulary import Vocabulary

ARRANGEMENT_KEYS = (
    VERSION, "name", "profile", "observe", "cycle_ms", "timing", "finished", "fairness",
    "types", "tables", "whiteboard", "machines", "environment", "schedule", "processes", "pool", "operators", "access",
    KEY,
)  # fmt: skip
INSTANCE_KEYS = ("file", "inline", "parameters", "suspended", "on_fault", "model")
ENVIRONMENT_KEYS = ("file", "inline", "parameters")
WHITEBOARD_KEYS = ("type", "init", "role", "changes", "safe", KEY)
MACHINE_KEYS = (VERSION, "machine", "parameters", "variables", "initial", "suspend", "states", KEY)
STATE_KEYS = ("name", "variables", *ACTION_KINDS, "transitions", "stays", "runs", KEY)
TRANSITION_KEYS = ("when", "to", KEY)
VARIABLE_KEYS = ("type", "init", KEY)

VOCABULARY = Vocabulary(
    keys=frozenset((*ARRANGEMENT_KEYS, *INSTANCE_KEYS, *WHITEBOARD_KEYS, *MACHINE_KEYS, *STATE_KEYS, *TRANSITION_KEYS)),
    guards=("when",),
    actions=ACTION_KINDS,
    named=("types", "tables", "whiteboard", "machines", "variables", "parameters", "processes"),
    called={
        "when": "if guard condition cond",
        "to": "target goto then next dest destination",
        "name": "state id title",
        "machine": "name id",
        "machines": "fsms fsm",
        "whiteboard": "variables vars globals shared inputs outputs",
        "types": "enums enum",
        "init": "default value initial",
        "initial": "init start begin initial_state",
        "internal": "do during loop tick action body",
        "on_entry": "entry enter",
        "on_exit": "exit leave",
        "stays": "final end terminal",
        "cycle_ms": "period tick step dt cycle",
        "variables": "vars locals",
        "schedule": "order sequence",
        "environment": "plant surroundings",
    },
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
        "`machines`": "write `NAME: {file: NAME.machine.yaml}`, one per line",
        **dict.fromkeys(("`whiteboard`", "`variables`"), "write `NAME: {type: TYPE}`, one per line"),
    },
    hints=HINTS,
)
