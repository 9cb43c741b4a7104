"""Chaos: a machine that stands for any other with the same states, as far as others can tell.

In each turn it writes any value to every variable that `access` lets the machine write and that others read, gives any
commands that the machine may give, and goes to any of its states. It finishes where the machine can, and faults where
a fault unloads the machine. It also reads those inputs of the properties that a machine before it has read, because a
letter shows the last sample of a cycle. If no other machine asks for the machine's state, chaos has one state.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from llfsm_verify.extensions.guards.rewiring import instances
from llfsm_verify.plug import (
    ACTION_KINDS,
    Arrangement,
    ArrayType,
    AtState,
    DeclaredType,
    Draft,
    EnumType,
    InstanceDraft,
    Machine,
    NewMachine,
    NewState,
    Query,
    Read,
    Reading,
    RecordType,
    UnreadablePart,
    decimal_text,
    digits_of,
    has_int,
    implied,
    machine_in,
    of_kind,
    syntax_nodes,
)

LOADS = ("load", "load_suspended", "unload")
MOST_PARTS = 2_000
"""Values that chaos chooses in one turn."""


class Uncovered(Exception):
    """Chaos cannot do all that a machine could; the text says what."""


def with_chaos(
    draft: Draft, arrangement: Arrangement, guarded: Sequence[str], read: Collection[str], *, commands: bool = True
) -> Draft:
    """A draft in which chaos stands for each of the guarded machines. `read`: the variables that a property reads.
    `commands` False: it gives none, which is less than it may do.

    Uncovered: chaos cannot do all that the machines could.
    """
    read = {*read, *_read_by_others(arrangement, guarded)}
    old = draft.arrangement
    assert not isinstance(old, UnreadablePart)
    found = []
    reading = Reading(Path())
    for instance in instances(old):
        name = instance.name.text
        if name not in guarded:
            found.append(instance)
            continue
        chaos = chaos_machine(arrangement, arrangement.machine(name), guarded, read, commands)
        found.append(_model(reading, instance, chaos))
    return reading.added(draft, replace(old, machines=tuple(found)))


def with_model(draft: Draft, name: str, model: NewMachine) -> Draft:
    """A draft in which a model takes the place of a machine."""
    old = draft.arrangement
    assert not isinstance(old, UnreadablePart)
    reading = Reading(Path())
    machines = tuple(_model(reading, i, model) if i.name.text == name else i for i in instances(old))
    return reading.added(draft, replace(old, machines=machines))


def _model(reading: Reading, instance: InstanceDraft, model: NewMachine) -> InstanceDraft:
    machine = reading.machine_text(f"<any {instance.name.text}>", machine_in(model))
    is_model = implied("true", instance.name.span)
    return InstanceDraft(instance.name, machine, (), instance.suspended, is_model, instance.on_fault)


def chaos_machine(
    arrangement: Arrangement, machine: Machine, guarded: Sequence[str], read: Collection[str], commands: bool = True
) -> NewMachine:
    """Chaos in the place of `machine`, as far as it writes what is `read`. Uncovered: it cannot do all that the machine
    could."""
    own = _own_prefix(arrangement)
    turn = [*_samples(arrangement, machine, guarded, read, own), *_writes(arrangement, machine, read)]
    if commands:
        turn += _commands(arrangement, machine, guarded, own)
    if _watched(arrangement, machine, guarded):
        # A fault that ends the run ends what there is to keep.
        fault = _fault(own) if machine.on_fault == "unload" else ()
        return _all_states(machine, [*turn, *fault], f"{own}next")
    return _one_state(turn)  # to be suspended, unloaded or finished is to leave everything as it is


def _own_prefix(arrangement: Arrangement) -> str:
    """How names of chaos begin, and no other name does."""
    known = [entry.variable.name for entry in arrangement.whiteboard] + [m.name for m in arrangement.texts]
    known += [*arrangement.types, *arrangement.tables, *(v for e in arrangement.enumerations for v in e.values)]
    prefix = "chaos_"
    while any(name.startswith(prefix) for name in known):
        prefix += "_"
    return prefix


def _read_by_others(arrangement: Arrangement, guarded: Sequence[str]) -> Iterator[str]:
    """The variables of the whiteboard in the texts of the machines that are not chaos."""
    others = tuple(m.states for m in arrangement.texts if m.name not in guarded)
    return (read.variable.name for read in of_kind(others, Read) if read.variable.scope == "whiteboard")


def _watched(arrangement: Arrangement, machine: Machine, guarded: Sequence[str]) -> bool:
    """Whether it matters in which state the machine is: to machines that are not chaos, or that it runs and that are
    watched."""
    if machine.nested and not any(
        machine.name in state.runs for owner in guarded for state in arrangement.machine(owner).states
    ):
        return True
    inner = [name for state in machine.states for name in state.runs]
    if any(name not in guarded or _watched(arrangement, arrangement.machine(name), guarded) for name in inner):
        return True
    others = [m.states for m in arrangement.texts if m.name not in guarded]
    asked = (node for node in syntax_nodes(tuple(others)) if isinstance(node, AtState | Query))
    return any(node.machine == machine.name for node in asked)


def _unloaded_by_others(arrangement: Arrangement, machine: Machine, guarded: Sequence[str]) -> bool:
    """Whether an operator or a machine that is not chaos may unload it, so that chaos can load it again."""
    others = (m for m in arrangement.machines if m.name not in guarded)
    return any(c.kind == "unload" and c.machine == machine.name for m in others for c in m.commands()) or any(
        o.kind == "unload" and o.target == machine.name for o in arrangement.operators
    )


def _one_state(turn: list[str]) -> NewMachine:
    """It also does in each turn what it likes when it is suspended, as `on_suspend` and a suspend state may."""
    states = [NewState(name, {"internal": turn}, stays=True) for name in ("ANY", "ASIDE")]
    return NewMachine("Chaos", states, suspend="ASIDE")


def _all_states(machine: Machine, turn: list[str], choice: str) -> NewMachine:
    """It goes to the state that it has chosen the turn before, or when it came to where it is."""
    last = len(machine.states) - 1
    go = f"{choice} = choose(0..{last});"
    # One of the first two runs in a turn, and the others in one of a suspension.
    anywhere = {kind: [*turn, go] for kind in ACTION_KINDS}
    states = [
        NewState(
            state.name,
            {**anywhere, "on_entry": [go]},
            [
                (f"{choice} == {number}", other.name)
                for number, other in enumerate(machine.states)
                if other is not state and not state.finishes
            ],
            stays=last == 0 and not state.finishes,
            runs=state.runs,
        )
        for state in machine.states
    ]
    return NewMachine(
        "Chaos",
        states,
        variables={choice: {"type": f"0..{last}"}},
        initial=machine.states[machine.initial].name,
        suspend=None if machine.suspend is None else machine.states[machine.suspend].name,
    )


def _samples(
    arrangement: Arrangement, machine: Machine, guarded: Sequence[str], read: Collection[str], own: str
) -> Iterator[str]:
    """Reads of the inputs of which a letter would otherwise show the sample that a machine before has taken.

    To read an input that is in no sample of the cycle so far changes nothing: its value is any in both cases.
    """
    (process,) = arrangement.processes
    before = process.schedule[: process.schedule.index(machine.name)]
    texts = tuple(arrangement.machine(name).states for name in before if name not in guarded)
    mentioned = {node.variable.name for node in of_kind(texts, Read) if node.variable.scope == "whiteboard"}
    places = [
        part
        for entry in arrangement.whiteboard
        if entry.role == "input" and entry.variable.name in read and entry.variable.name in mentioned
        for part in _parts(entry.variable.name, entry.variable.type)
    ]
    for number, (place, kind) in enumerate(places):
        low = kind.values[0] if isinstance(kind, EnumType) else _bounds(kind)[0]
        yield f"bool {own}sees_{number} = {place}{f' == {low}' if low else ''};"


def _writes(arrangement: Arrangement, machine: Machine, read: Collection[str]) -> Iterator[str]:
    access = arrangement.access
    count = 0
    for entry in arrangement.whiteboard:
        variable = entry.variable
        if entry.role == "input" or variable.name not in read:
            continue
        if access is not None and not access.may_write(machine.name, variable.name):
            continue
        if access is not None and access.clearance(machine.name) and variable.name not in access.write:
            continue  # above the lowest level a machine writes named variables only
        if has_int(variable.type):
            raise Uncovered(
                f"`{variable.name}` has infinitely many values (`int`), so no machine can write all of them"
            )
        for place, kind in _parts(variable.name, variable.type):
            count += 1
            if count > MOST_PARTS:
                raise Uncovered(f"`{machine.name}` may write more than {MOST_PARTS:,} values")
            yield f"{place} = choose({_values(kind)});"


def _parts(place: str, kind: DeclaredType) -> Iterator[tuple[str, DeclaredType]]:
    """The scalars of a variable."""
    if isinstance(kind, ArrayType):
        for i in range(kind.size):
            yield from _parts(f"{place}[{i}]", kind.element)
    elif isinstance(kind, RecordType):
        for name, field in kind.fields:
            yield from _parts(f"{place}.{name}", field)
    else:
        yield place, kind


def _values(kind: DeclaredType) -> str:
    if isinstance(kind, EnumType):
        return ", ".join(kind.values)
    low, high = _bounds(kind)
    return f"{low}..{high}" if low else "bool"


def _bounds(kind: DeclaredType) -> tuple[str, str]:
    """The least and the largest number of a type; empty: it is not one of numbers."""
    low, high = getattr(kind, "low", None), getattr(kind, "high", None)
    if low is None or high is None:
        return "", ""
    digits = digits_of(kind)
    return decimal_text(low, digits), decimal_text(high, digits)


def _commands(arrangement: Arrangement, machine: Machine, guarded: Sequence[str], own: str) -> Iterator[str]:
    """Any commands to any machine in which they can be seen.

    What several of them in one turn leave is what one of these does: a resume leaves a restart that is pending, unless
    a suspend came between, and what is commanded before an unload or a load is lost, or given again after it.
    """
    access = arrangement.access
    for number, target in enumerate(arrangement.machines):
        unseen = target.name in guarded and not _watched(arrangement, target, guarded)
        if unseen and not _unloaded_by_others(arrangement, target, guarded):
            continue

        def may(kind: str, to: str = target.name) -> bool:
            return access is None or access.may_command(machine.name, kind, to)

        name = target.name
        if unseen:  # everything else that may become of it is to leave everything as it is
            if may("load"):
                chosen = f"{own}load_{number}"
                yield f"0..1 {chosen} = choose(0..1); if ({chosen} == 1) {{ load({name}); }}"
            continue
        loads = [] if target.nested else [f"{kind}({name});" for kind in LOADS if may(kind)]
        if len(loads) == len(LOADS):
            loads += [f"unload({name}); {load}" for load in loads[:2]]
        orders = [f"{kind}({name});" for kind in ("suspend", "resume", "restart") if may(kind)]
        if len(orders) > 1:
            orders.append(f"{orders[0]} {orders[1]}")
        for word, choices in (("load", loads), ("order", orders)):
            if choices:
                chosen = f"{own}{word}_{number}"
                yield f"0..{len(choices)} {chosen} = choose(0..{len(choices)});"
                yield from (f"if ({chosen} == {i}) {{ {text} }}" for i, text in enumerate(choices, 1))


def _fault(own: str) -> Iterator[str]:
    yield f"0..1 {own}fails = choose(0..1);"
    yield f"{own}fails = 1 / (1 - {own}fails);"
