"""Runs of the executor along given choices: what a trace shows is read off here, never off the search."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from llfsm_verify.backends.native.executor import NativeProgram, StepResult
from llfsm_verify.checking.trace import Change, Event, Sampled, TraceStep
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program, Var
from llfsm_verify.values import value_text

SHOWN_CONTROL = ("state", "pending", "finished", "loaded")


class Execution:
    """The native executor of one program, with all bits kept, and how its records are shown."""

    def __init__(self, program: Program) -> None:
        self.program = program
        unloading = any(v.name.endswith(".$faulted") for v in program.vars)
        self.native = NativeProgram(program, events=unloading or bool(program.refusals))
        self.layout = self.native.layout
        self._vars = [v for v in program.vars if not v.output]
        self._texts = [_Shown(v) for v in self._vars]
        self._last: dict[bytes, tuple[tuple[str, str], ...]] = {}
        self._choices = {c.name: c for c in program.choices}

    def start(self, free: Sequence[tuple[str, int]] = ()) -> bytes:
        """The initial record in which the free variables have these values (their first ones otherwise)."""
        return self.layout.first(dict(free))

    def free(self, record: bytes) -> tuple[tuple[str, int], ...]:
        values = self.layout.decode(record)
        result = []
        for var in self._vars:
            value = values[var.name]
            if var.free:
                assert isinstance(value, int)
                result.append((var.name, value))
        return tuple(result)

    def configuration(self, record: bytes) -> bytes:
        return record[: self.layout.configuration_bytes]

    def step(self, record: bytes, ringlet: Move) -> StepResult:
        known = {name: value for name, value in ringlet.choices.items() if name in self._choices}
        return self.native.step(record, ringlet.process, known)

    def enabled(self, record: bytes) -> list[int]:
        """The processes that may step; none: only the stutter is left."""
        values = self.layout.decode(record)
        return [i for i, p in enumerate(self.program.processes) if p.ended is None or not values[p.ended]]

    def bits(self, record: bytes, outputs: Sequence[str]) -> int:
        """The letter after the step that led to `record`, as a mask over Bool outputs."""
        values = self.layout.decode_outputs(record)
        return sum(1 << i for i, name in enumerate(outputs) if values[name])

    # ------------------------------------------------ showing

    def shown(self, record: bytes) -> tuple[tuple[str, str], ...]:
        """Every variable that users know with the text of its value, arrays element by element."""
        values = self.layout.decode(record)
        return tuple(pair for var, show in zip(self._vars, self._texts, strict=True) for pair in show(values[var.name]))

    def _shown(self, record: bytes) -> tuple[tuple[str, str], ...]:
        """`shown`, remembered for the last two records: a run shows each of them twice."""
        key = self.configuration(record)
        found = self._last.get(key)
        if found is None:
            found = self.shown(record)
            if len(self._last) > 1:
                del self._last[next(iter(self._last))]
            self._last[key] = found
        return found

    def describe(
        self, before: bytes, ringlet: Move, result: StepResult, atoms: tuple[tuple[str, bool], ...]
    ) -> TraceStep:
        """The step from `before` as a trace shows it; a faulting step changes nothing."""
        program = self.program
        read = tuple(self._sampled(program.choices[i].name, value) for i, value in result.samples)
        sampled, world = read[: result.read], read[result.read :]
        if ringlet.process is None:
            return TraceStep(None, None, "", None, sampled, (), False, True, atoms, world=world)
        process = program.processes[ringlet.process]
        values = self.layout.decode(before)
        turn = values[process.turn]
        assert isinstance(turn, int)
        slot = program.slots[process.slots[turn]]
        info = program.machines[slot.machine]
        if result.status != 0:
            state = values[slot.state]
            assert isinstance(state, int)
            return TraceStep(process.name, info.name, info.states[state], None, sampled, (), False, False, ())
        outputs = self.layout.decode_outputs(result.record)
        spent, fired, cycle = outputs[program.spent], outputs[program.fired], outputs[program.cycle]
        assert isinstance(spent, int)
        assert isinstance(fired, int)
        transition = None
        if fired:
            transition = info.transition_text(spent, fired - 1)
        old, new = dict(self._shown(before)), self._shown(result.record)
        changes = tuple(Change(name, old[name], text) for name, text in new if old[name] != text)
        observed = program.observe == "ringlet" or bool(cycle)
        return TraceStep(
            process.name, info.name, info.states[spent], transition, sampled, changes, bool(cycle), observed,
            atoms if observed else (), world=world, events=self._events(result),
        )  # fmt: skip

    def _events(self, result: StepResult) -> tuple[Event, ...]:
        found: list[Event] = []
        for kind, _, arguments in result.events:
            if kind == "refused":
                found.append(Event(kind, self.program.refusals[arguments[0]]))
            elif kind == "faulted":
                found.append(Event(kind, self.program.faults[arguments[0]]))
        return tuple(found)

    def _sampled(self, name: str, value: int) -> Sampled:
        choice = self._choices[name]
        return Sampled(name, choice.input, value, value_text(choice.type, choice.labels, value))


class _Shown:
    """How one variable appears in a trace: not at all (most control variables), or with a name and a text."""

    def __init__(self, var: Var) -> None:
        self._var = var
        machine, _, what = var.name.partition(".$")
        self._name: str | None = var.name
        origin = var.origin
        self._elements = [origin.pattern.format(*index) for index in product(*map(range, origin.shape))]
        if var.origin.kind == "control":
            self._name = None
            if what in SHOWN_CONTROL:
                self._name = machine if what == "state" else f"{machine}.{what}"

    def __call__(self, value: int | tuple[int, ...]) -> list[tuple[str, str]]:
        if self._name is None:
            return []
        if isinstance(value, tuple):
            return [(name, self._text(v)) for name, v in zip(self._elements, value, strict=True)]
        return [(self._name, self._text(value))]

    def _text(self, value: int) -> str:
        return value_text(self._var.type, self._var.origin.labels, value)
