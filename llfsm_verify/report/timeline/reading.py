"""Timelines of recordings and of saved traces, both performed again by the executor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.report.timeline.timeline import Row, Signal, Timeline
from llfsm_verify.runtime.live.frame import CYCLE, HEADER_WORDS, NUMBER, STEPS, FrameLayout
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.preparing import starting_values
from llfsm_verify.runtime.live.slots import Slot, program_slots, slots_of
from llfsm_verify.runtime.recording.file import Turn
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import Value


def recorded(arrangement: Arrangement, code: LiveCode, turns: Iterable[Turn]) -> Timeline:
    """A recording: a row for each frame. `turns` are those of `runtime.recording.replay`."""
    slots = slots_of(code)

    def rows() -> Iterator[Row]:
        for turn in turns:
            frame = turn.frame
            cycle = frame[CYCLE] + (frame[NUMBER] > 1)
            yield Row(frame[STEPS], cycle, tuple(slot.value(frame) for slot in slots))

    return Timeline(arrangement.name, _signals(slots), rows(), arrangement.cycle_ms)


def traced(arrangement: Arrangement, schedule: Schedule) -> Timeline:
    """A saved trace: a row for each step."""
    loop = None if schedule.loop is None else schedule.loop + 1
    return stepped(arrangement, schedule.free, schedule.ringlets, loop)


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
