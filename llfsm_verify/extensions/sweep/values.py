"""Values put into the draft of an arrangement: constants, parameters of instances, and initial values of variables."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from llfsm_verify.extensions.sweep.task import ValueKind
from llfsm_verify.plug import (
    ArrangementDraft,
    Draft,
    InstanceDraft,
    Json,
    MachineDraft,
    Node,
    Scalar,
    Source,
    StateDraft,
    UnreadablePart,
    VariableDraft,
    WhiteboardDraft,
    compose,
    implied,
)

VALUES = "<values>"
"""The name of values in diagnostics, where no file says them."""
V = TypeVar("V", VariableDraft, WhiteboardDraft)


@dataclass(frozen=True, slots=True)
class NoSuchName(Exception):
    """An arrangement has nothing of this name that could have a value; `known` is what it has."""

    kind: ValueKind
    name: str
    known: tuple[str, ...]


def node_of(value: Json) -> Node:
    """A value as a file would have it."""
    return compose(Source(VALUES, json.dumps(value, ensure_ascii=False)), [])


def with_values(
    draft: Draft, values: Sequence[tuple[ValueKind, str, Json]], node: Callable[[Json], Node] = node_of
) -> Draft:
    """The draft with these values in the place of its own. Its digest is of the old one and of the values.

    A `constant` is a parameter of that name and kind of all machines that have it; a `parameter` is one of an instance
    (`left.speed`), of any kind; an `initial` value is one of the whiteboard, of a machine (`left.count`) or of a state
    (`left.WAIT.count`). NoSuchName: there is no such one.
    """
    given = [(kind, name, node(value)) for kind, name, value in values]
    found = with_nodes(draft, given)
    text = json.dumps([draft.digest, *values], ensure_ascii=False)
    return replace(found, digest=hashlib.sha256(text.encode()).hexdigest()) if values else draft


def with_nodes(draft: Draft, values: Sequence[tuple[ValueKind, str, Node]]) -> Draft:
    """The same with values as they are written, and with the digest as it was."""
    found = draft.arrangement
    for kind, name, node in values:
        if isinstance(found, UnreadablePart):
            break
        if name not in (known := names(found, kind)):
            raise NoSuchName(kind, name, tuple(known))
        found = _with_initial(found, name, node) if kind == "initial" else _with_argument(found, kind, name, node)
    sources = dict.fromkeys((*draft.sources, *(node.span.source for _, _, node in values)))
    return replace(draft, arrangement=found, sources=tuple(sources))


def names(arrangement: ArrangementDraft, kind: ValueKind) -> dict[str, None]:
    """What can have a value of this kind, in the order of the files."""
    return dict.fromkeys(_variables(arrangement) if kind == "initial" else _parameters(arrangement, kind))


def _parameters(arrangement: ArrangementDraft, kind: ValueKind) -> Iterator[str]:
    for instance, machine in _machines(arrangement):
        for parameter in machine.parameters:
            if kind == "parameter":
                yield f"{instance.name.text}.{parameter.name.text}"
            elif parameter.kind == "constant":
                yield parameter.name.text


def _variables(arrangement: ArrangementDraft) -> Iterator[str]:
    yield from (variable.name.text for variable in arrangement.whiteboard)
    for instance, machine in _machines(arrangement):
        here = instance.name.text
        yield from (f"{here}.{variable.name.text}" for variable in machine.variables)
        for state in _states(machine):
            if isinstance(state.name, Scalar):
                yield from (f"{here}.{state.name.text}.{variable.name.text}" for variable in state.variables)


def _machines(arrangement: ArrangementDraft) -> Iterator[tuple[InstanceDraft, MachineDraft]]:
    machines = () if isinstance(arrangement.machines, UnreadablePart) else arrangement.machines
    for instance in (*machines, *arrangement.plants):
        if isinstance(instance, InstanceDraft) and isinstance(instance.machine, MachineDraft):
            yield instance, instance.machine


def _states(machine: MachineDraft) -> tuple[StateDraft, ...]:
    return () if isinstance(machine.states, UnreadablePart) else machine.states


# ---------------------------------------------------------------- one value


def _with_argument(arrangement: ArrangementDraft, kind: ValueKind, name: str, node: Node) -> ArrangementDraft:
    owner, _, parameter = ("", "", name) if kind == "constant" else name.partition(".")

    def changed(instance: InstanceDraft) -> InstanceDraft:
        machine = instance.machine
        kinds = {p.name.text: p.kind for p in machine.parameters} if isinstance(machine, MachineDraft) else {}
        meant = kinds.get(parameter) == "constant" if kind == "constant" else instance.name.text == owner
        if not meant:
            return instance
        there = next((key for key, _ in instance.arguments if key.text == parameter), implied(parameter, node.span))
        others = tuple(each for each in instance.arguments if each[0].text != parameter)
        return replace(instance, arguments=(*others, (there, node)))

    return _each_instance(arrangement, changed)


def _with_initial(arrangement: ArrangementDraft, name: str, node: Node) -> ArrangementDraft:
    *owner, variable = name.split(".")
    if not owner:
        return replace(arrangement, whiteboard=_initial(arrangement.whiteboard, variable, node))

    def changed(instance: InstanceDraft) -> InstanceDraft:
        machine = instance.machine
        if instance.name.text != owner[0] or not isinstance(machine, MachineDraft):
            return instance
        if len(owner) == 1:
            return replace(instance, machine=replace(machine, variables=_initial(machine.variables, variable, node)))
        states = tuple(
            replace(state, variables=_initial(state.variables, variable, node))
            if isinstance(state.name, Scalar) and state.name.text == owner[1]
            else state
            for state in _states(machine)
        )
        return replace(instance, machine=replace(machine, states=states))

    return _each_instance(arrangement, changed)


def _each_instance(
    arrangement: ArrangementDraft, changed: Callable[[InstanceDraft], InstanceDraft]
) -> ArrangementDraft:
    machines = arrangement.machines
    plants = tuple(changed(plant) if isinstance(plant, InstanceDraft) else plant for plant in arrangement.plants)
    if not isinstance(machines, UnreadablePart):
        machines = tuple(map(changed, machines))
    return replace(arrangement, machines=machines, plants=plants)


def _initial(variables: tuple[V, ...], name: str, node: Node) -> tuple[V, ...]:
    return tuple(replace(each, init=node) if each.name.text == name else each for each in variables)
