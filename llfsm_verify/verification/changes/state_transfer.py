"""Where a run stands, said in the variables of another program: that of the arrangement with another machine in it.

The new machine is as if it had just been loaded: in its initial state, its own variables with the values that those of
the same name and type had, and no command waits for it. It has its turn in the next cycle, also where the old one had
left the schedule. All else stays as it is. What may be loaded there is an update point: a run at the end of a cycle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from struct import pack
from typing import Protocol

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.program.program import Int, Program, Var
from llfsm_verify.values import Value

LASTING = ("loaded",)
"""Of a new machine: control that does not begin anew."""
NEEDED = ("state", "finished", "loaded", "pending", "ended")
"""Control that must not be lost. Other control is missing in a program where nothing would read it."""


class HasLayout(Protocol):
    """A program, and how its records lie."""

    @property
    def program(self) -> Program: ...
    @property
    def layout(self) -> Layout: ...


class Untransferable(Exception):
    """What the run is in now is nothing that the new program can be in; the message says why."""


class StateTransfer:
    """From records of `old` to those of `new`, in which `machine` is replaced; None: no machine is.

    `first` is where `new` begins.
    """

    def __init__(self, old: HasLayout, new: HasLayout, first: bytes, machine: str | None) -> None:
        self._old, self._new = old.layout, new.layout
        self._first = new.layout.decode_record(first)
        self._same: list[str] = []
        """Variables whose values are kept as they are."""
        self._other: list[tuple[Var, Var]] = []
        """Those of which the value may be another, or none."""
        before = {variable.name: variable for variable in old.program.vars}
        for variable in new.program.vars:
            known = before.pop(variable.name, None)
            if known is None or (_is_of(variable, machine) and not _lasts(variable, known, machine)):
                continue
            if (known.type, known.length, known.origin.labels) == (
                variable.type,
                variable.length,
                variable.origin.labels,
            ):
                self._same.append(variable.name)
            else:
                self._other.append((known, variable))
        self._lost = [
            variable
            for name, variable in before.items()
            if not variable.output and not _is_of(variable, machine) and name.rpartition(".$")[2] in NEEDED
        ]
        """Control that `new` has not, and that must be as it was at first."""
        self._unknown = [
            (f"{info.name}.$state", info.suspend)
            for info in old.program.machines
            if info.suspend is not None and f"{info.name}.$remembered" in new.layout.fields
            if info.name != machine and f"{info.name}.$remembered" not in old.layout.fields
            if f"{info.name}.$pending" in old.layout.fields  # else it is as it began
        ]
        """The states of machines that can be resumed in `new`, with the suspend state; `old` does not keep where to."""
        self._turn = next(_turns(new.program, machine), None)
        """The variable whose turn it is in the process of the machine, and the machine's number there."""
        self._loaded = f"{machine}.$loaded"

    def record(self, record: bytes) -> bytes:
        """The record of `new` for a run that stands at `record`. Untransferable: another machine would be changed."""
        values = self._old.decode_record(record)
        found = dict(self._first)
        for name in self._same:
            found[name] = values[name]
        for known, variable in self._other:
            value = _moved(known, variable, values[variable.name])
            if value is not None:
                found[variable.name] = value
            elif not variable.output:
                raise Untransferable(f"`{variable.name}` cannot be {_text(known, values[variable.name])} any more")
        for variable in self._lost:
            if values[variable.name] != variable.init:
                told = _text(variable, values[variable.name])
                raise Untransferable(f"`{variable.name}` is {told}, which nothing could change any more")
        for name, suspend in self._unknown:
            if values[name] == suspend:
                machine = name.removesuffix(".$state")
                raise Untransferable(f"`{machine}` is suspended, and the run does not keep where it would be resumed")
        if self._turn is not None and found.get(self._loaded, 1):
            turn, at = self._turn
            first = found[turn]
            assert isinstance(first, int)
            found[turn] = min(first, at)  # a cycle begins, perhaps without the old machine
        return self._new.encode_record(found)


def transferred(old: HasLayout, record: bytes, new: HasLayout, first: bytes, machine: str | None) -> bytes:
    """One record, transferred; see `StateTransfer`."""
    return StateTransfer(old, new, first, machine).record(record)


def _turns(program: Program, machine: str | None) -> Iterator[tuple[str, int]]:
    turns = {process.turn for process in program.processes}
    for variable in program.vars:
        if variable.name in turns and machine in variable.origin.labels:
            yield variable.name, variable.origin.labels.index(machine)


def _is_of(variable: Var, machine: str | None) -> bool:
    return variable.origin.machine == machine


def _lasts(variable: Var, known: Var, machine: str | None) -> bool:
    """Whether a variable of the machine that is replaced keeps its value."""
    if variable.origin.kind == "control":
        return variable.name in {f"{machine}.${what}" for what in LASTING}
    alike = (known.type, known.length, known.origin) == (variable.type, variable.length, variable.origin)
    return alike and not variable.output


def _moved(old: Var, new: Var, value: Value) -> Value | None:
    """The value in the type of another program; None: there is no such one."""
    if old.length != new.length:
        return None
    numbers = [_number(old, new, number) for number in _numbers(value)]
    if any(number is None for number in numbers):
        return None
    whole = tuple(number for number in numbers if number is not None)
    return whole if isinstance(value, tuple) else whole[0]


def _number(old: Var, new: Var, value: int) -> int | None:
    if not isinstance(new.type, Int) or not isinstance(old.type, Int):
        return value if old.type == new.type else None
    if old.type.digits != new.type.digits:
        return None
    if old.origin.labels != new.origin.labels:
        at = value - old.type.low
        label = old.origin.labels[at] if 0 <= at < len(old.origin.labels) else None
        return new.type.low + new.origin.labels.index(label) if label in new.origin.labels else None
    if old.type.high != new.type.high and value == old.type.high and new.name.endswith(".$clock"):
        return None if new.type.high > value else new.type.high  # a clock stops at its highest value
    if new.name.endswith(".$clock"):
        value = min(value, new.type.high)
    return value if new.type.low <= value <= new.type.high else None


def _numbers(value: Value) -> Iterator[int]:
    yield from value if isinstance(value, tuple) else (value,)


def _text(variable: Var, value: Value) -> str:
    labels, kind = variable.origin.labels, variable.type
    if isinstance(value, int) and isinstance(kind, Int) and 0 <= value - kind.low < len(labels):
        return labels[value - kind.low]
    return str(value)


UNKNOWN = "it is unknown whether it may be loaded"


@dataclass(frozen=True, slots=True)
class Accepted:
    """Nothing wrong is reachable where it is loaded at the end of a cycle in one of `points`."""

    points: frozenset[bytes]
    """What `update_point` gives."""
    notes: tuple[str, ...]
    """What else is to be said, in sentences without their full stops."""


def update_point(code: HasLayout, record: bytes, states: Iterable[int]) -> bytes:
    """A configuration of a run and the states of its monitors."""
    return record[: code.layout.configuration_bytes] + b"".join(pack("<q", state) for state in states)
