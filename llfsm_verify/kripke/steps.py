"""How the edges of a structure are taken: whose ringlet each is, which transition fired, which inputs were sampled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.backends.native.executor import Edge, NativeProgram
from llfsm_verify.kripke.observing import observed_outputs
from llfsm_verify.kripke.structure import Structure
from llfsm_verify.program.labelling import is_class
from llfsm_verify.values import Shown, shown, text

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.words import Words


@dataclass(frozen=True, slots=True)
class Step:
    """One way to take an edge: the machine, the state in which its ringlet was spent, the number of the transition that
    fired there (None: none did), and the inputs it sampled: their values, or the label of those that stand for a class
    of values (``distance in 100..499``). `machine` "" is the stutter of what has ended."""

    machine: str
    state: str
    fired: int | None
    inputs: tuple[tuple[str, Shown], ...]
    labels: tuple[str, ...] = ()

    def __str__(self) -> str:
        if not self.machine:
            return "ended"
        fired = "" if self.fired is None else f".{self.fired}"
        inputs = "".join(f" {name}={text(value)}" for name, value in self.inputs)
        labels = "".join(f" {label}" for label in self.labels)
        return f"{self.machine}@{self.state}{fired}{inputs}{labels}"


class Steps:
    """The steps of a structure whose edges are ringlets (``observe: ringlet``), performed again natively.

    Raises ValueError for a structure whose edges are whole cycles.
    """

    def __init__(self, structure: Structure) -> None:
        program = structure.program
        if program.observe != "ringlet":
            raise ValueError("the edges of this structure are whole cycles")
        self._structure = structure
        self._labels = structure.symbolic
        self._native = NativeProgram(program if self._labels is None else self._labels.program)
        layout = self._native.layout
        self._width = layout.configuration_bytes
        self._outputs = layout.encode_outputs(layout.initial_outputs())
        self._observed = [layout.reader(output) for _, output in observed_outputs(program)]
        self._words: Words | None = None
        if self._labels is not None:
            from llfsm_verify.kripke.labels.words import Words

            self._words = Words(self._labels)
        self._ran = layout.reader(program.ran)
        self._spent = layout.reader(program.spent)
        self._fired = layout.reader(program.fired)

    def of(self, configuration: int) -> dict[int, tuple[Step, ...]]:
        """By the number of each edge of a configuration: the ways to take it, in the order of their choices."""
        s = self._structure
        edges = range(int(s.indptr[configuration]), int(s.indptr[configuration + 1]))
        numbers = {(s.keys[s.targets[e]].tobytes(), tuple(map(bool, s.alphabet[s.labels[e]]))): e for e in edges}
        found: dict[int, dict[Step, None]] = {e: {} for e in edges}
        before = s.keys[configuration].tobytes() + self._outputs
        for edge in self._native.edges(before, 1):
            if edge.status == 0:
                letter = tuple(bool(read(edge.record)) for read in self._observed)
                step = self._step(before, edge)
                found[numbers[edge.record[: self._width], letter]][step] = None
        return {e: tuple(steps) for e, steps in found.items()}

    def _step(self, before: bytes, edge: Edge) -> Step:
        program, record = self._native.program, edge.record
        choices = [(program.choices[c], x) for c, x in edge.samples]
        inputs = tuple(
            (c.source, shown(c.type, c.labels, x)) for c, x in choices if c.kind != "age" and not is_class(c)
        )
        labels: tuple[str, ...] = ()
        if self._words is not None and self._labels is not None:
            labels = tuple(map(self._words.of, self._labels.read(before, edge)))
        if edge.process < 0:
            return Step("", "", None, inputs, labels)
        machine = program.machines[program.slots[self._ran(record) - 1].machine]
        fired = self._fired(record)
        return Step(machine.name, machine.states[self._spent(record)], fired - 1 if fired else None, inputs, labels)
