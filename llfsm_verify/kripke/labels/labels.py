"""The symbolic labels of a program: what is explored in its place, and what each step of that means for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

from llfsm_verify.backends.native.executor import Edge
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, evaluate
from llfsm_verify.kripke.labels.planning import Decided, Planner, Split
from llfsm_verify.kripke.labels.sizes import InputNote, is_wide, size
from llfsm_verify.kripke.observing import move_of
from llfsm_verify.program.labelling import Classes, label_program
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.values import Value


@dataclass(frozen=True, slots=True)
class Read:
    """A class that a step has read: its group, the valuation of the variables it depends on, the representative."""

    split: Split
    valuation: tuple[int, ...]
    member: tuple[int, ...]


class Labels:
    """A program whose inputs are classes. Its graph is that of `original`: configurations, edges, letters and faults.

    `program` has one fault more, after those of the original: `unknown`, which no step ends in.
    """

    def __init__(self, planner: Planner, decided: Decided) -> None:
        self.original = planner.program
        self.planner = planner
        self.program = label_program(self.original, decided.plan())
        self.unknown = len(self.original.faults)
        self.notes = _notes(self.original, decided)
        self._layout = Layout.of(self.program)
        self._interpreter = Interpreter(self.program)
        self._by_name: dict[str, tuple[Split, Classes]] = {c.name: (s, c) for s, c in decided.classes.items()}

    def move(self, before: bytes, edge: Edge) -> Move:
        """The move of the original program that a step of `program` from a record stands for."""
        move = move_of(self.program, edge)
        chosen: dict[str, int] = {}
        # A block knows better than the letter after it, whose classes then decide the other members only; and what was
        # read as a value is that value.
        for read in sorted(self.read(before, edge), key=lambda r: r.split.place.slot is not None):
            chosen |= {c.name: x for c, x in zip(read.split.choices, read.member, strict=True)}
        chosen |= {name: x for name, x in move.choices.items() if name not in self._by_name}
        return Move(move.process, chosen)

    def read(self, before: bytes, edge: Edge) -> list[Read]:
        """The classes that a step from a record has read."""
        found: list[Read] = []
        for index, number in edge.samples:
            name = self.program.choices[index].name
            if name not in self._by_name:
                continue
            split, classes = self._by_name[name]
            variables: Mapping[str, Value] = {}
            if classes.keys:
                variables = self._variables(split, before, edge)
            valuation = self.planner.valuation(classes.keys, variables)
            found.append(Read(split, valuation, _member(classes, valuation, variables, number)))
        return found

    def _variables(self, split: Split, before: bytes, edge: Edge) -> Mapping[str, Value]:
        """Variables and outputs where the block of the split begins."""
        layout, program = self._layout, self.program
        if split.place.slot is None:  # the letter changes nothing that its classes depend on
            return {**layout.decode(edge.record), **layout.decode_outputs(edge.record)}
        known = {program.choices[i].name: x for i, x in edge.samples}

        def choose(choice: Choice) -> int:
            return known[choice.name]

        return self._interpreter.begun(
            layout.decode(before), layout.decode_outputs(before), max(edge.process, 0), choose
        )


def _member(
    classes: Classes, valuation: tuple[int, ...], variables: Mapping[str, Value], number: int
) -> tuple[int, ...]:
    if classes.candidates:
        return (sorted(evaluate(e, variables, {}) for e in classes.candidates)[number],)
    rows = classes.rows[valuation]
    return rows[min(number, len(rows) - 1)]


def _notes(program: Program, decided: Decided) -> tuple[InputNote, ...]:
    """What is said of each wide input: the most classes of a reading, or why its values are tried one by one."""
    found: dict[tuple[str, ...], InputNote] = {}
    enumerated: dict[str, str] = {}
    for _, choices, why in decided.refused:  # letters come last, and follow the ringlets before them
        for c in filter(is_wide, choices):
            enumerated.setdefault(c.source, why)
    sizes = {c.source: size(c) for c in program.choices}
    for split, classes in decided.classes.items():
        inputs = tuple(dict.fromkeys(c.source for c in split.choices))
        if not set(inputs) & set(enumerated):
            old = found.get(inputs)
            most = classes.size if old is None or old.classes is None else max(classes.size, old.classes)
            found[inputs] = InputNote(inputs, prod(sizes[i] for i in inputs), most)
    shown = sorted(found.values(), key=lambda n: (len(n.inputs), n.inputs))
    return (*shown, *(InputNote((name,), sizes[name], None, why) for name, why in sorted(enumerated.items())))
