"""What happened over time: signals, and a row of their values for each moment of a recording or of a saved trace, both
performed again by the executor.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import islice
from typing import NamedTuple

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Int, Program
from llfsm_verify.runtime.live.frame import CYCLE, HEADER_WORDS, NUMBER, STEPS, FrameLayout
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.live.slots import Slot, program_slots, slots_of
from llfsm_verify.runtime.recording.file import Turn
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import Shown, Value

NANOSECONDS = 1_000_000
"""Of a millisecond. Rows of one cycle follow each other by one of them, so that each can be seen."""
UNTIMED_CYCLE = 1000
"""Nanoseconds that a cycle of an untimed arrangement takes in the file."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A slot over time: the state of a machine, a variable, an input."""

    name: str
    kind: str
    """As of `runtime.live.slots.Slot`."""
    type: Int
    labels: tuple[str, ...]


class Row(NamedTuple):
    """The values of all signals at one moment."""

    step: int
    """Ringlets so far."""
    cycle: int
    """The cycle of logical time in which that was; 0 before it."""
    values: tuple[Shown, ...]
    """In the order of the signals."""
    fired: tuple[str, ...] = ()
    """``ns: RED -> GREEN when car`` of the transition that fired since the row before; of a trace only."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Signals and rows, which can be read once, in their order."""

    title: str
    signals: tuple[Signal, ...]
    rows: Iterable[Row]
    cycle_ms: Fraction | None
    """Logical time of a cycle; None: the arrangement is untimed."""
    loop: int | None = None
    """The step from which on the run repeats forever, if it does."""
    begins: int = 0
    """The cycle that begins at time 0. A step has the time at which its cycle begins, as bounds in time count it, so
    that this is cycle 1; a frame of a recording has the time at which its cycle is over."""
    shows: str = ""
    """What a trace shows, such as the property that it violates."""
    failed: int | None = None
    """The step after which nothing can satisfy that property any more, if it violates one so."""

    def part(self, first: int, last: int | None) -> Timeline:
        """The rows of the steps from `first` to `last`; one before them says how things stand."""
        return replace(self, rows=_part(self.rows, first, last))

    def time_ms(self, row: Row) -> Fraction | None:
        """Logical time of a row in milliseconds."""
        return None if self.cycle_ms is None else self._passed(row) * self.cycle_ms

    def nanoseconds(self, row: Row) -> int:
        """The same for viewers; a cycle of an untimed arrangement takes UNTIMED_CYCLE."""
        return self._passed(row) * (UNTIMED_CYCLE if self.cycle_ms is None else int(self.cycle_ms * NANOSECONDS))

    def _passed(self, row: Row) -> int:
        return max(row.cycle - self.begins, 0)


def _part(rows: Iterable[Row], first: int, last: int | None) -> Iterator[Row]:
    before = None
    for row in rows:
        if last is not None and row.step > last:
            return
        if row.step < first:
            before = row
            continue
        if before is not None:
            yield before
            before = None
        yield row


def take(rows: Iterable[Row], most: int) -> tuple[list[Row], bool]:
    """So many rows at most, and whether there were more."""
    found = list(islice(rows, most + 1))
    return found[:most], len(found) > most


def recorded(arrangement: Arrangement, code: LiveCode, turns: Iterable[Turn]) -> Timeline:
    """A recording: a row for each frame. `turns` are those of `runtime.recording.replay`."""
    slots = slots_of(code)

    def rows() -> Iterator[Row]:
        for turn in turns:
            frame = turn.frame
            cycle = frame[CYCLE] + (frame[NUMBER] > 1)
            yield Row(frame[STEPS], cycle, tuple(slot.value(frame) for slot in slots))

    return Timeline(arrangement.name, _signals(slots), rows(), arrangement.cycle_ms)


def traced(arrangement: Arrangement, schedule: Schedule, shows: str = "", failed: int | None = None) -> Timeline:
    """A saved trace: a row for each step."""
    loop = None if schedule.loop is None else schedule.loop + 1
    return replace(stepped(arrangement, schedule.free, schedule.ringlets, loop), shows=shows, failed=failed)


def timeline_of(trace: Trace, arrangement: Arrangement, execution: Execution, shows: str = "") -> Timeline:
    """A row for each step, without the one that ends in a fault, which leaves no configuration."""
    processes = {process.name: number for number, process in enumerate(arrangement.processes)}
    moves = (
        Move(None if step.process is None else processes[step.process], {s.choice: s.value for s in step.choices})
        for step in trace.steps
    )
    loop = None if trace.loop is None else trace.loop + 1
    made = stepped(arrangement, trace.initial_free, moves, loop, execution)
    return replace(made, shows=shows, failed=trace.failed_at)


def stepped(
    arrangement: Arrangement,
    free: Sequence[tuple[str, int]],
    moves: Iterable[Move],
    loop: int | None = None,
    execution: Execution | None = None,
) -> Timeline:
    """A run of these moves, which may still be made while it is read: a row for each step. `execution` is that of
    `execution_of`, where there is one already."""
    execution = execution_of(arrangement) if execution is None else execution
    program = execution.program
    layout = execution.layout
    frames = FrameLayout.of(program, layout)
    slots = program_slots(program, layout, frames)
    names = {choice.name: number for number, choice in enumerate(program.choices)}
    begin = starting_values(program)

    def rows() -> Iterator[Row]:
        record = execution.start(free)
        choices = [begin.get(choice.name, choice.type.low) for choice in program.choices]
        ended = layout.reader(program.cycle)
        cycle, whole = 0, True

        def row(step: int, *fired: str) -> Row:
            words = [int.from_bytes(record[i : i + 8], "little", signed=True) for i in range(0, len(record), 8)]
            frame = [0] * HEADER_WORDS + words + [0] * len(program.slots) + choices
            return Row(step, cycle, tuple(slot.value(frame) for slot in slots), fired)

        yield row(0)
        for step, move in enumerate(moves, 1):
            for name, value in move.choices.items():
                if name in names:
                    choices[names[name]] = value
            result = execution.step(record, move)
            if result.status:
                return
            record = result.record
            cycle, whole = cycle + whole, bool(ended(record))
            yield row(step, *_fired(program, layout.decode_outputs(record)))

    return Timeline(arrangement.name, _signals(slots), rows(), arrangement.cycle_ms, loop, begins=1)


def execution_of(arrangement: Arrangement) -> Execution:
    """What performs a trace: compiled once for all traces of the arrangement."""
    return Execution(lower(arrangement, keep_all_bits=True))


def _signals(slots: Iterable[Slot]) -> tuple[Signal, ...]:
    return tuple(Signal(slot.name, slot.kind, slot.choice.type, slot.labels) for slot in slots)


def _fired(program: Program, outputs: Mapping[str, Value]) -> tuple[str, ...]:
    ran, spent, number = (outputs[name] for name in (program.ran, program.spent, program.fired))
    assert isinstance(ran, int)
    assert isinstance(spent, int)
    assert isinstance(number, int)
    if not ran or not number:
        return ()
    machine = program.machines[program.slots[ran - 1].machine]
    return (f"{machine.name}: {machine.transition_text(spent, number - 1)}",)
