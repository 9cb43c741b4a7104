"""Runs performed once more by the executor, step by step, with all that a page shows of a step: values, the transition
that fired, the lines that ran, refusals and faults.

The letters of the program that is performed tell what comes out at each place of the source, as where coverage is
measured, so that no line is shown by guessing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from llfsm_verify.plug import (
    ACTIONS,
    Arrangement,
    BoardSlot,
    Execution,
    FrameLayout,
    IfElse,
    Machine,
    Move,
    Observer,
    Shown,
    Span,
    lower,
    probed,
    program_slots,
    starting_values,
)

FIELDS = dict(zip(ACTIONS, ("on_exit", "internal", "on_suspend", "on_resume"), strict=True))
"""The fields of a state that hold the actions which probes number."""


class Taken(NamedTuple):
    """A step, or where the run begins (`machine` None, no step yet)."""

    step: int
    cycle: int
    values: tuple[Shown, ...]
    """In the order of `Performing.slots`."""
    machine: str | None
    """Whose ringlet it was; None: all have ended."""
    fired: tuple[int, int] | None
    """The state, and the number of its transition that fired."""
    ran: tuple[Span, ...]
    events: tuple[tuple[str, str, Span | None], ...]
    """``refused`` or ``faulted``, what is said of it, and where."""
    frame: int | None
    """Of a recording."""
    fault: tuple[str, Span | None] | None = None
    """Why the step cannot be taken, and where: nothing is changed by it."""


@dataclass(frozen=True, slots=True)
class Step:
    """A move to perform, and the frame of a recording that it belongs to, with its cycle."""

    move: Move
    frame: int | None = None
    cycle: int | None = None


class Performing:
    """Performs runs of an arrangement."""

    def __init__(self, arrangement: Arrangement) -> None:
        self._machines = {machine.name: machine for machine in arrangement.texts}
        told = probed(arrangement, keep_all_bits=True)
        self._beside = Execution(told.program)
        """Tells what comes out at each place; faults are outcomes there, so that half of a step would be shown."""
        self.execution = Execution(lower(arrangement, keep_all_bits=True))
        program, layout = self.execution.program, self.execution.layout
        self._frames = FrameLayout.of(program, layout)
        self.slots: tuple[BoardSlot, ...] = program_slots(program, layout, self._frames)
        self._observer = Observer(told.program, self._beside.layout)
        named = {name: outcome for outcome, name in told.outputs.items()}
        self._outcomes = tuple(named.get(name) for name in self._observer.names)
        self._names = {choice.name: number for number, choice in enumerate(program.choices)}
        self._cycle, self._ran, self._fired, self._spent = map(
            layout.reader, (program.cycle, program.ran, program.fired, program.spent)
        )
        control = [slot.state.removesuffix("state") for slot in program.slots]
        self._state = [layout.reader(slot.state) for slot in program.slots]
        self._entered = [layout.reader(f"{name}entered") for name in control]
        pending = [f"{name}pending" for name in control]
        self._pending = [layout.reader(name) if name in layout.fields else _nothing for name in pending]
        self._lines: dict[tuple[int, int, bool, int], tuple[Span, ...]] = {}

    def run(self, start: Callable[[Execution], bytes], steps: Iterable[Step], cycle: int = 0) -> Iterator[Taken]:
        """The beginning in the record that `start` gives, in this cycle, and each step until one cannot be taken.
        Cycles of several processes are counted together, unless the steps say theirs."""
        program, execution, beside = self.execution.program, self.execution, self._beside
        record, shadow = start(execution), start(beside)
        begin = starting_values(program)
        choices = [begin.get(choice.name, choice.type.low) for choice in program.choices]
        words = [0] * self._frames.words
        whole = True

        def values() -> tuple[Shown, ...]:
            for at in range(0, len(record), 8):
                words[self._frames.record + at // 8] = int.from_bytes(record[at : at + 8], "little", signed=True)
            words[self._frames.choices : self._frames.choices + len(choices)] = choices
            return tuple(slot.value(words) for slot in self.slots)

        yield Taken(0, cycle, values(), None, None, (), (), None)
        for number, step in enumerate(steps, 1):
            for name, value in step.move.choices.items():
                if name in self._names:
                    choices[self._names[name]] = value
            result, told = execution.step(record, step.move), beside.step(shadow, step.move)
            cycle = cycle + whole if step.cycle is None else step.cycle
            before, record, shadow = record, result.record, told.record
            slot = None if step.move.process is None else self._slot(before, step.move.process)
            machine = None if slot is None else self._machines[program.machines[program.slots[slot].machine].name]
            who = None if machine is None else machine.name
            letter = 0 if told.status else self._observer.letter(shadow)
            if result.status:
                lines = (
                    () if slot is None or machine is None else self._ran_lines(machine, slot, before, before, letter)
                )
                yield Taken(number, cycle, values(), who, None, lines, (), step.frame, self._fault(result.status))
                return
            whole = bool(self._cycle(record))
            if slot is None or machine is None or not self._ran(record):
                yield Taken(number, cycle, values(), None, None, (), (), step.frame)
                continue
            fired = (self._spent(record), self._fired(record) - 1) if self._fired(record) else None
            lines = self._ran_lines(machine, slot, before, record, letter)
            sites = {"refused": program.refusals, "faulted": program.faults}
            events = tuple(
                (kind, sites[kind][found[0]].message, sites[kind][found[0]].span)
                for kind, _, found in result.events
                if kind in sites
            )
            yield Taken(number, cycle, values(), who, fired, lines, events, step.frame)

    def _slot(self, record: bytes, process: int) -> int:
        """Whose turn it is."""
        of = self.execution.program.processes[process]
        turn = self.execution.layout.decode(record)[of.turn]
        assert isinstance(turn, int)
        return of.slots[turn]

    def _fault(self, status: int) -> tuple[str, Span | None]:
        faults = self.execution.program.faults
        if not 0 < status <= len(faults):
            return "a value leaves 64 bits", None
        site = faults[status - 1]
        return f"{site.code}: {site.message}", site.span

    def _ran_lines(self, machine: Machine, slot: int, before: bytes, after: bytes, letter: int) -> tuple[Span, ...]:
        """The actions and guards that ran in a ringlet, in the order of its text. `after`: the record before, where the
        step ends in a fault."""
        spent = self._state[slot](before) if after is before else self._spent(after)
        moved = self._state[slot](before) != spent or bool(self._pending[slot](before))
        enters = moved or not self._entered[slot](before)
        key = (slot, spent, enters, letter)
        if key not in self._lines:
            self._lines[key] = tuple(self._told(machine, spent, enters, letter))
        return self._lines[key]

    def _told(self, machine: Machine, spent: int, enters: bool, letter: int) -> Iterator[Span]:
        came = [self._outcomes[bit] for bit in range(letter.bit_length()) if letter >> bit & 1]
        outcomes = [outcome for outcome in came if outcome is not None and outcome.probe.machine == machine.name]
        conditions = [(o.probe.span, bool(o.value)) for o in outcomes if o.probe.kind == "condition"]
        took = {(span.start, span.end): value for span, value in conditions if span is not None}
        if enters and spent < len(machine.states):
            yield from _statements(machine.states[spent].on_entry, took)
        for outcome in outcomes:
            probe = outcome.probe
            if probe.kind == "guard" and 0 <= probe.state < len(machine.states):
                yield machine.states[probe.state].transitions[probe.number].span
            elif probe.kind == "action" and 0 <= probe.state < len(machine.states):
                state = machine.states[probe.state]
                yield from _statements(getattr(state, FIELDS[ACTIONS[probe.number]]), took)


def _statements(actions: Sequence[object], took: dict[tuple[int, int], bool]) -> Iterator[Span]:
    """The places of statements, without branches that were not taken."""
    for statement in actions:
        span: Span = statement.span  # type: ignore[attr-defined]
        if not isinstance(statement, IfElse):
            yield span
            continue
        condition = statement.condition.span
        yield condition
        result = took.get((condition.start, condition.end))
        if result is not False:
            yield from _statements(statement.then, took)
        if result is not True:
            yield from _statements(statement.otherwise, took)


def _nothing(_: bytes | bytearray | memoryview) -> int:
    return 0
