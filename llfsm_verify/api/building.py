"""Arrangements written in Python: machines and states as values, and diagnostics that say where in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from llfsm_verify.api.model import Model
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import ACTION_KINDS
from llfsm_verify.arrangement.nodes import Mapping as MappingNode
from llfsm_verify.arrangement.nodes import Node, Scalar, compose
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span

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


Step = str | int
"""A key, or an index of a list."""

Machines = Mapping[str, MachineDefinition | InstanceDefinition | Path | Mapping[str, object]]
"""Each name with a machine, a use of one, the path of a machine file, or a mapping with the keys of a file."""


def build(
    name: str,
    machines: Machines,
    *,
    whiteboard: Mapping[str, object] | None = None,
    types: Mapping[str, object] | None = None,
    schedule: Sequence[str] | None = None,
    processes: Mapping[str, object] | None = None,
    profile: object = None,
    observe: str | None = None,
    cycle_ms: object = None,
    timing: str | None = None,
    finished: str | None = None,
    fairness: str | None = None,
    lint: Mapping[str, str] | None = None,
) -> Model:
    """An arrangement from Python values. Arguments mean what the keys of an arrangement file mean.

    Without `schedule` and `processes`, machines take turns in the order of `machines`. Raises `DiagnosticError` as
    `load` does, with places such as ``machines.ns.states.GREEN.transitions[1].when``; TypeError: a value is of a type
    that has no meaning there.
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
        "whiteboard": whiteboard,
        "machines": {key: _instance(f"machines.{key}", value) for key, value in machines.items()},
        "schedule": list(machines) if schedule is None and processes is None else schedule,
        "processes": processes,
        "lint": lint,
    }
    given = {key: value for key, value in document.items() if value is not None}
    for key, value in given.items():
        _look_through((key,), value)
    try:
        arrangement = build_arrangement(given)
    except DiagnosticError as error:
        raise DiagnosticError(_placed(error.diagnostics)) from None
    return Model(replace(arrangement, warnings=tuple(_placed(arrangement.warnings))))


# ---------------------------------------------------------------- from definitions to the shape of files


def _instance(place: str, value: object) -> Mapping[str, object]:
    if isinstance(value, Mapping):
        return value
    if isinstance(value, MachineDefinition | Path):
        value = InstanceDefinition(value)
    if not isinstance(value, InstanceDefinition):
        raise TypeError(f"{place}: a machine is a definition, a path or a mapping, not {value!r:.80}")
    found: dict[str, object] = {}
    if isinstance(value.machine, MachineDefinition):
        found["inline"] = _machine(place, value.machine)
    else:
        found["file"] = str(value.machine)
    if value.arguments:
        found["parameters"] = dict(value.arguments)
    if value.suspended:
        found["suspended"] = True
    return found


def _machine(place: str, machine: MachineDefinition) -> Mapping[str, object]:
    found: dict[str, object] = {"machine": machine.name}
    for key in ("parameters", "variables", "initial", "suspend"):
        value = getattr(machine, key)
        if value:
            found[key] = value
    found["states"] = [_state(f"{place}.states.{name}", name, state) for name, state in machine.states.items()]
    return found


def _state(place: str, name: str, state: object) -> Mapping[str, object]:
    if isinstance(state, Mapping):
        given: dict[str, object] = {"name": name, **state}
    elif isinstance(state, StateDefinition):
        given = {"name": name, **{f.name: getattr(state, f.name) for f in fields(state)}}
    else:
        raise TypeError(f"{place}: a state is a definition or a mapping, not {state!r:.80}")
    transitions = given.get("transitions") or ()
    if not isinstance(transitions, Sequence) or isinstance(transitions, str):
        raise TypeError(f"{place}.transitions: this is a sequence, not {transitions!r:.80}")
    given["transitions"] = [_transition(f"{place}.transitions[{i}]", one) for i, one in enumerate(transitions)]
    empty = [key for key in (*ACTION_KINDS, "variables", "transitions") if key in given and not given[key]]
    return {key: value for key, value in given.items() if key not in empty}


def _transition(place: str, one: object) -> Mapping[str, object]:
    if isinstance(one, Mapping):
        return one
    if isinstance(one, tuple) and len(one) == 2:
        return {"when": one[0], "to": one[1]}
    raise TypeError(f"{place}: a transition is a pair of a guard and a state's name, or a mapping, not {one!r:.80}")


def _look_through(path: tuple[Step, ...], value: object) -> None:
    """TypeError: a value that no file could have, or a key that is not a text."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if not isinstance(key, str):
                raise TypeError(f"{_path_text(path)}: a key is a text, not {key!r:.80}")
            _look_through((*path, key), item)
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            named = path[-1] == "states" and isinstance(item, Mapping) and isinstance(item.get("name"), str)
            _look_through((*path, item["name"] if named else index), item)
    elif value is not None and not isinstance(value, str | int | bool):
        what = "a text, a whole number, a Boolean, a list or a mapping"
        raise TypeError(f"{_path_text(path)}: a value is {what}, not {value!r:.80}")


# ---------------------------------------------------------------- places in the user's values


def _placed(diagnostics: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The diagnostics with places in the values that were given, instead of in the text that was made of them."""
    trees: dict[int, Node] = {}
    for diagnostic in diagnostics:
        span = diagnostic.span
        if span is None or span.source.name != "<document>":
            yield diagnostic  # about a machine file
            continue
        if id(span.source) not in trees:
            trees[id(span.source)] = compose(span.source, [])
        path, node = _innermost(trees[id(span.source)], span.start)
        name = _path_text(path)
        if node is None:
            yield replace(diagnostic, span=None, file=name)
            continue
        offsets = list(node.fragment.offsets)
        start = sum(offset < span.start for offset in offsets)
        end = sum(offset < span.end for offset in offsets)
        last = len(node.text)
        yield replace(diagnostic, span=Span(Source(name, node.text), min(start, last), min(max(end, start), last)))


def _innermost(root: Node, offset: int) -> tuple[list[Step], Scalar | None]:
    """The way to the innermost value at a place of the text, and the text there: a value, or a key."""
    path: list[Step] = []
    node = root
    while not isinstance(node, Scalar):
        # The span of a collection is that of its opening bracket: what is inside follows it.
        if isinstance(node, MappingNode):
            before = [(key, value) for key, value in node.items if key.span.start <= offset]
            if not before:
                return path, None
            key, node = before[-1]
            path.append(key.text)
            if offset < key.span.end:
                return path, key
        else:
            index = sum(value.span.start <= offset for value in node.items) - 1
            if index < 0:
                return path, None
            node = node.items[index]
            path.append(_state_name(node, index) if path[-1:] == ["states"] else index)
    return path, node


def _state_name(node: Node, index: int) -> Step:
    """States are given by name."""
    items = node.items if isinstance(node, MappingNode) else ()
    return next((v.text for k, v in items if k.text == "name" and isinstance(v, Scalar)), index)


def _path_text(path: Sequence[Step]) -> str:
    """The way as users would write it, from an argument of `build` on."""
    words = list(path)
    if words[:1] == ["machines"] and len(words) > 2:
        if words[2] == "inline":
            del words[2]
            words[2:3] = ["name"] if words[2:3] == ["machine"] else words[2:3]
        elif words[2] == "parameters":
            words[2] = "arguments"
    text = ""
    for word in words:
        text += f"[{word}]" if isinstance(word, int) else f".{word}"
    return text.removeprefix(".") or "the arrangement"
