"""What a step shows: the letters of a program's records, and the move that a step was."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from llfsm_verify.backends.native.executor import Edge
from llfsm_verify.backends.native.layout import WORD_BYTES, BitField, Layout
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Atom, Program
from llfsm_verify.values import Value


def observed_outputs(program: Program) -> tuple[tuple[str, str], ...]:
    """What letters show, as (name, output variable): the atoms in order, then what fairness asks about."""
    fair = [name for f in program.fairness for name in (f.premise, f.goal) if name is not None]
    return (*((a.name, a.output) for a in program.atoms), *((name, name) for name in fair))


class AtomOverflow(OverflowError):
    """An atom leaves 64 bits."""

    def __init__(self, atom: str) -> None:
        super().__init__(f"`{atom}` leaves 64 bits")
        self.atom = atom


def atoms_at(atoms: Iterable[Atom], values: Mapping[str, Value], inputs: Mapping[str, int]) -> dict[str, bool]:
    """Which atoms are true where variables and locals have these values. Raises AtomOverflow."""
    found = {}
    for atom in atoms:
        try:
            found[atom.name] = bool(evaluate(atom.expression, values, inputs, shared=True))
        except OverflowError:
            raise AtomOverflow(atom.name) from None
    return found


def initial_atoms(program: Program, layout: Layout, record: bytes) -> dict[str, bool]:
    """The atoms over an initial configuration, with inputs at their `init`. Raises AtomOverflow."""
    outputs = {v.name: v.init for v in program.vars if v.output}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    return atoms_at(program.atoms, layout.decode(record) | outputs, inputs)


def move_of(program: Program, edge: Edge) -> Move:
    """The move of a step that the executor made."""
    choices = program.choices
    return Move(None if edge.process < 0 else edge.process, {choices[c].name: v for c, v in edge.samples})


def _runs(fields: Sequence[BitField]) -> list[tuple[int, int, int]]:
    """Bits of a record that follow each other as those of a letter do: the first one, their mask, the letter's bit."""
    runs: list[tuple[int, int, int]] = []
    for place, field in enumerate(fields):
        assert (field.bits, field.low) == (1, 0), "what a letter shows is Boolean"
        word, shift = field.place(0)
        bit = 8 * WORD_BYTES * word + shift
        first, mask, begin = runs.pop() if runs else (bit, 0, place)
        if bit - first != place - begin:
            runs.append((first, mask, begin))
            first, mask, begin = bit, 0, place
        runs.append((first, mask << 1 | 1, begin))
    return runs


class Observer:
    """Reads the letters of one program's records, as masks over `names`."""

    def __init__(self, program: Program, layout: Layout) -> None:
        self._program = program
        self._layout = layout
        outputs = observed_outputs(program)
        self.names = tuple(name for name, _ in outputs)
        self._runs = _runs([layout.fields[output] for _, output in outputs])
        self._cycle = layout.reader(program.cycle)

    def letter(self, record: bytes) -> int:
        """The letter after the step that led to a record."""
        number, letter = int.from_bytes(record, "little"), 0
        for first, mask, place in self._runs:
            letter |= (number >> first & mask) << place
        return letter

    def first_letter(self, record: bytes) -> int:
        """Those of `initial_atoms`. Raises AtomOverflow."""
        atoms = initial_atoms(self._program, self._layout, record)
        return sum(1 << i for i, holds in enumerate(atoms.values()) if holds)

    def ends_cycle(self, record: bytes) -> bool:
        """Whether the step that led to a record completed a cycle."""
        return bool(self._cycle(record))

    def mask(self) -> bytes:
        """Output words in which the bits that letters depend on are set."""
        mask, layout = 0, self._layout
        for _, output in observed_outputs(self._program):
            field = layout.fields[output]
            word, shift = field.place(0)
            mask |= (1 << field.bits) - 1 << 64 * (word - layout.words) + shift
        return mask.to_bytes(8 * layout.output_words, "little")
