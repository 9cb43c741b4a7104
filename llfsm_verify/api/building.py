"""Arrangements written in Python: machines and states as values, which become the shape of a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from decimal import Decimal
from pathlib import Path

from llfsm_verify.api.model import Model, with_files
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import ACTION_KINDS

Transitions = Sequence[tuple[str, str] | Mapping[str, object]]
"""Each a guard with the name of the state that it leads to, or a mapping with the keys of a file."""


@dataclass(frozen=True, slots=True)
class StateDefinition:
    """A state. Actions are statements as in files, such as ``"light = RED;"``."""

    on_entry: str | None = None
    on_exit: str | None = None
    internal: str | None = None
    on_suspend: str | None = None
    on_resume: str | None = None
    transitions: Transitions = ()
    """In the order in which they are tried."""
    variables: Mapping[str, object] = field(default_factory=dict)
    stays: bool = False
    """It has no transitions, and the machine does not finish in it."""


@dataclass(frozen=True, slots=True)
class MachineDefinition:
    """A machine, which may be used several times: see `bind`."""

    name: str
    states: Mapping[str, StateDefinition | Mapping[str, object]]
    """By name."""
    initial: str | None = None
    """The state in which it begins; None: the first one."""
    suspend: str | None = None
    """The state for suspension."""
    variables: Mapping[str, object] = field(default_factory=dict)
    """Each name with a mapping: its ``type``, and its value at first (``init``)."""
    parameters: Mapping[str, object] = field(default_factory=dict)
    """Each name with what it stands for: ``"machine"``, or a mapping such as ``{"whiteboard": "bool"}``."""

    knowledge: Mapping[str, object] = field(default_factory=dict)
    """Each name with a mapping: its theory (``file``), what that is told (``inputs``), and its ``output``."""

    def bind(self, *, suspended: bool = False, **arguments: object) -> InstanceDefinition:
        """This machine with arguments for its parameters. `suspended`: it starts so."""
        return InstanceDefinition(self, arguments, suspended)


@dataclass(frozen=True, slots=True)
class InstanceDefinition:
    """A use of a machine, or of a machine file."""

    machine: MachineDefinition | str | Path
    arguments: Mapping[str, object] = field(default_factory=dict)
    """What the parameters of the machine stand for here."""
    suspended: bool = False
    model: bool = False
    """It stands for something else, and may choose."""
    on_fault: str = "end"
    """`unload`: a fault in its ringlet unloads it."""


OPTIONAL = (*ACTION_KINDS, "variables", "transitions", "stays")
"""The keys of a state that it need not have."""

Machines = Mapping[str, MachineDefinition | InstanceDefinition | Path | Mapping[str, object]]
"""Each name with a machine, a use of one, the path of a machine file, or a mapping with the keys of a file."""


def build(
    name: str,
    machines: Machines,
    *,
    whiteboard: Mapping[str, object] | None = None,
    types: Mapping[str, object] | None = None,
    tables: Mapping[str, Sequence[object]] | None = None,
    knowledge: Mapping[str, object] | None = None,
    schedule: Sequence[str] | None = None,
    processes: Mapping[str, object] | None = None,
    profile: object = None,
    observe: str | None = None,
    cycle_ms: object = None,
    timing: str | None = None,
    finished: str | None = None,
    fairness: str | None = None,
    lint: Mapping[str, str] | None = None,
    environment: MachineDefinition | InstanceDefinition | Path | Mapping[str, object] | None = None,
    pool: Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    operators: Mapping[str, Sequence[str]] | None = None,
    access: Mapping[str, object] | None = None,
) -> Model:
    """An arrangement from Python values. Arguments mean what the keys of an arrangement file mean.

    `environment` is the model of the surroundings, or several by their names. Without `schedule` and `processes`,
    machines take turns in the order of `machines`, without those of the `pool`. Raises `DiagnosticError` as `load`
    does; places are those in the shape of a file, in which the definition of machine `ns` is ``machines.ns.inline``.
    TypeError: a value is of a type that has no meaning there.
    """
    document: dict[str, object] = {
        "name": name,
        "profile": profile,
        "observe": observe,
        "cycle_ms": cycle_ms,
        "timing": timing,
        "finished": finished,
        "fairness": fairness,
        "types": types,
        "tables": tables,
        "whiteboard": whiteboard,
        "knowledge": knowledge,
        "machines": _instances(machines),
        "environment": None if environment is None else _environment(environment),
        "schedule": schedule
        if schedule is not None or processes is not None
        else [m for m in machines if m not in _named(pool)],
        "processes": processes,
        "pool": pool,
        "operators": operators,
        "access": access,
        "lint": lint,
    }
    given = {key: value for key, value in document.items() if value is not None}
    seen: set[int] = set()
    for key, value in given.items():
        _look_through(key, value, seen)
    return Model(build_arrangement(given), with_files(given, os.path.abspath))


# ---------------------------------------------------------------- from definitions to the shape of files


def _instances(machines: object) -> Mapping[str, object]:
    if not isinstance(machines, Mapping):
        raise TypeError(f"machines: this is a mapping from names to machines, not {machines!r:.80}")
    return {key: _instance(f"machines.{key}", value) for key, value in machines.items()}


def _environment(value: object) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        return _instance("environment", value)
    made = MachineDefinition | InstanceDefinition | Path
    return {key: _instance(f"environment.{key}", one) if isinstance(one, made) else one for key, one in value.items()}


def _instance(place: str, value: object) -> Mapping[str, object]:
    if isinstance(value, Mapping):
        return value
    if isinstance(value, MachineDefinition | Path):
        value = InstanceDefinition(value)
    if not isinstance(value, InstanceDefinition):
        raise TypeError(f"{place}: a machine is a definition, a path or a mapping, not {value!r:.80}")
    found: dict[str, object] = {}
    if isinstance(value.machine, MachineDefinition):
        found["inline"] = _machine(f"{place}.inline", value.machine)
    else:
        found["file"] = str(value.machine)
    if value.arguments:
        found["parameters"] = dict(value.arguments)
    if value.suspended:
        found["suspended"] = True
    if value.model:
        found["model"] = True
    if value.on_fault != "end":
        found["on_fault"] = value.on_fault
    return found


def _machine(place: str, machine: MachineDefinition) -> Mapping[str, object]:
    found: dict[str, object] = {"machine": machine.name}
    for key in ("parameters", "variables", "knowledge", "initial", "suspend"):
        value = getattr(machine, key)
        if value is not None and value != {}:
            found[key] = value
    states = enumerate(machine.states.items())
    found["states"] = [_state(f"{place}.states[{i}]", name, state) for i, (name, state) in states]
    return found


def _state(place: str, name: str, state: object) -> Mapping[str, object]:
    if isinstance(state, Mapping):
        given: dict[str, object] = {"name": name, **state}
    elif isinstance(state, StateDefinition):
        given = {"name": name, **{f.name: getattr(state, f.name) for f in fields(state)}}
    else:
        raise TypeError(f"{place}: a state is a definition or a mapping, not {state!r:.80}")
    transitions = given.get("transitions")
    if transitions is None:
        transitions = ()
    if not isinstance(transitions, Sequence) or isinstance(transitions, str):
        raise TypeError(f"{place}.transitions: this is a sequence, not {transitions!r:.80}")
    given["transitions"] = [_transition(f"{place}.transitions[{i}]", one) for i, one in enumerate(transitions)]
    empty: tuple[object, ...] = (None, {}, [], False)
    return {key: value for key, value in given.items() if key not in OPTIONAL or value not in empty}


def _transition(place: str, one: object) -> Mapping[str, object]:
    if isinstance(one, Mapping):
        return one
    if isinstance(one, tuple) and len(one) == 2:
        return {"when": one[0], "to": one[1]}
    raise TypeError(f"{place}: a transition is a pair of a guard and a state's name, or a mapping, not {one!r:.80}")


def _look_through(place: str, value: object, seen: set[int]) -> None:
    """TypeError: a value that no file could have, or a key that is not a text. `seen`: what was looked at, by `id`."""
    if isinstance(value, Mapping | list | tuple):
        if id(value) in seen:
            return
        seen.add(id(value))
    if isinstance(value, Mapping):
        for key, item in value.items():
            if not isinstance(key, str):
                raise TypeError(f"{place}: a key is a text, not {key!r:.80}")
            _look_through(f"{place}.{key}", item, seen)
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            _look_through(f"{place}[{index}]", item, seen)
    elif value is not None and not isinstance(value, str | int | bool | float | Decimal):
        what = "a text, a number, a Boolean, a list or a mapping"
        raise TypeError(f"{place}: a value is {what}, not {value!r:.80}")


def _named(pool: Sequence[str] | Mapping[str, Sequence[str]] | None) -> set[str]:
    """The machines of a pool, or of those of all processes."""
    lists = pool.values() if isinstance(pool, Mapping) else [pool or ()]
    return {name for names in lists for name in names}
