"""The slots of a whiteboard: what a reader needs to know to find values in frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from llfsm_verify.backends.native.layout import WORD_BITS, Layout
from llfsm_verify.program.program import INT64_MAX, INT64_MIN, Choice, Int, Program, Var
from llfsm_verify.runtime.live.frame import FrameLayout
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.values import Shown, element_names, showing

STATE, INPUT, VERDICT = "state", "input", "verdict"


@dataclass(frozen=True, slots=True)
class Slot:
    """One value in a frame: some bits of a word, and what they mean."""

    name: str
    kind: str
    """``input``, ``whiteboard``, ``machine`` (a variable of one), ``state``: in which state the machine is, or
    ``verdict`` of a monitor."""
    word: int
    shift: int
    bits: int
    offset: int
    """What is added to the bits, which have no sign; of 64 bits, modulo 2^64."""
    low: int
    high: int
    boolean: bool = False
    digits: int = 0
    labels: tuple[str, ...] = ()

    def value(self, frame: Sequence[int]) -> Shown:
        """The value in a frame, as users write it."""
        return self.reader()(frame[self.word])

    def number(self, frame: Sequence[int]) -> int:
        """The value in a frame as a number, as programs have it."""
        number = (frame[self.word] >> self.shift & (1 << self.bits) - 1) + self.offset
        return number - (1 << WORD_BITS) if number > self.high else number

    def reader(self) -> Callable[[int], Shown]:
        """A function from the slot's word to its value."""
        shift, mask, offset, high = self.shift, (1 << self.bits) - 1, self.offset, self.high
        show = showing(self.choice.type, self.labels)

        def value(word: int) -> Shown:
            number = (word >> shift & mask) + offset
            if number > high:
                number -= 1 << WORD_BITS
            return show(number)

        return value

    @property
    def choice(self) -> Choice:
        """What values it can have, as if they were chosen."""
        return Choice(self.name, Int(self.low, self.high, self.boolean, self.digits), "input", self.name, self.labels)


def slots_of(code: LiveCode) -> tuple[Slot, ...]:
    """Whatever users know of a frame: its program's slots, and verdicts of monitors as ``verdict(NAME)``."""
    found = list(program_slots(code.program, code.layout, code.frames))
    for number, (name, verdicts) in enumerate(zip(code.monitors, code.verdicts, strict=True)):
        where = (code.frames.monitors + number, 0, WORD_BITS, 0)
        found.append(Slot(f"verdict({name})", VERDICT, *where, 0, len(verdicts) - 1, labels=verdicts))
    return tuple(found)


class Stored(NamedTuple):
    """A slot that the program stores: its kind (as of `Slot`), the variable, which element of it, and its values."""

    kind: str
    var: Var
    number: int
    choice: Choice


def stored(program: Program) -> Iterator[Stored]:
    """States of machines, and variables, elements of arrays one by one."""
    states = {slot.state: program.machines[slot.machine] for slot in program.slots}
    for var in program.vars:
        kind: str = "machine" if var.origin.kind == "state" else var.origin.kind
        labels, names = var.origin.labels, element_names(var)
        if var.name in states:
            kind, labels, names = STATE, states[var.name].states, (states[var.name].name,)
        elif var.output or kind in ("control", "output"):
            continue
        of = var.type if isinstance(var.type, Int) else Int(INT64_MIN, INT64_MAX)
        for number, name in enumerate(names):
            yield Stored(kind, var, number, Choice(name, of, "input", name, labels))


def program_slots(program: Program, layout: Layout, frames: FrameLayout) -> tuple[Slot, ...]:
    """What the program stores, and inputs."""
    found: list[Slot] = []
    for kind, var, number, choice in stored(program):
        field, of = layout.fields[var.name], choice.type
        word, shift = field.place(number)
        where = (frames.record + word, shift, field.bits, field.low)
        found.append(Slot(choice.name, kind, *where, of.low, of.high, of.boolean, of.digits, choice.labels))
    known = {slot.name for slot in found}
    for number, choice in enumerate(program.choices):
        if choice.input and choice.input not in known:
            known.add(choice.input)
            of = choice.type
            where = (frames.choices + number, 0, WORD_BITS, 0)
            found.append(Slot(choice.input, INPUT, *where, of.low, of.high, of.boolean, of.digits, choice.labels))
    return tuple(found)


def inputs_of(program: Program) -> dict[str, Choice]:
    """What can be posted: the inputs that change, each with the first choice that samples it."""
    found: dict[str, Choice] = {}
    for choice in program.choices:
        if choice.input:
            found.setdefault(choice.input, choice)
    return found
