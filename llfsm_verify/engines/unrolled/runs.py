"""Automata and monitors that read a run of bounded length: their states as unknowns, point by point."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import z3

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.labels import Cube, TruthTables
from llfsm_verify.automata.labels import cubes as cubes_of
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.omega.subsets import monitor_rows
from llfsm_verify.automata.safety import BadPrefix, PrefixMonitor
from llfsm_verify.backends.smt.arithmetic import OURS
from llfsm_verify.engines.unrolled.encoding import Loops
from llfsm_verify.limits import tick

MAX_BITS = 10
"""Atoms up to which what is made while it reads is asked for every letter."""
MAX_STATES, MAX_CUBES = 2_000, 20_000
BAD = -1


@dataclass(frozen=True, slots=True)
class TableMove:
    """From one state to another with every letter of one of `cubes`, masks over the bits of `Table.atoms`."""

    source: int
    target: int
    acceptance: int
    cubes: tuple[Cube, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """An automaton that is written out. State 0 is before the first letter; BAD is after a bad prefix."""

    atoms: tuple[str, ...]
    moves: tuple[TableMove, ...]
    states: int
    acceptance_sets: int


EVERY: tuple[Cube, ...] = ((0, 0),)
"""All letters."""
Steps = Callable[[int, int], Iterable[tuple[int, int]]]
"""(acceptance, target) of each move from a state with a letter."""


def monitor_table(monitor: PrefixMonitor, atoms: Sequence[str]) -> Table:
    """A monitor with all letters; AutomatonTooLarge."""
    first = monitor.initial()
    if first is None:
        return Table(tuple(atoms), (TableMove(0, BAD, 0, EVERY),), 1, 0)
    if isinstance(monitor, BadPrefix):
        rows = monitor_rows(monitor.closure, MAX_STATES, MAX_CUBES)
        moves = [
            TableMove(q, BAD if target is None else target, 0, tuple(cubes))
            for q, row in enumerate(rows)
            for target, cubes in row
        ]
        return Table(tuple(atoms), tuple(moves), len(rows), 0)

    def step(state: int, letter: int) -> Iterable[tuple[int, int]]:
        following = monitor.step(state, letter)
        return ((0, BAD if following is None else following),)

    return _asked(first, step, atoms, 0)


def automaton_table(automaton: Automaton | Lazy, atoms: Sequence[str]) -> Table:
    """An automaton with all letters of the atoms that it looks at; AutomatonTooLarge."""
    if automaton.is_empty:
        return Table(tuple(atoms), (), 1, automaton.acceptance_sets)
    if not isinstance(automaton, Automaton):
        return _asked(0, automaton, atoms, automaton.acceptance_sets)
    if len(automaton.edges) > MAX_STATES:
        raise AutomatonTooLarge("states", MAX_STATES)
    if automaton.transitions > MAX_CUBES:
        raise AutomatonTooLarge("transitions", MAX_CUBES)
    moves: dict[tuple[int, int, int], list[Cube]] = {}
    for source, row in enumerate(automaton.edges):
        for e in row:
            moves.setdefault((source, e.target, e.acceptance), []).append((e.positive, e.negative))
    made = tuple(TableMove(*key, tuple(cubes)) for key, cubes in moves.items())
    return Table(tuple(atoms), made, len(automaton.edges), automaton.acceptance_sets)


def _asked(first: int, step: Steps, atoms: Sequence[str], sets: int) -> Table:
    """What is made while it reads, asked in every state for every letter."""
    if len(atoms) > MAX_BITS:
        raise AutomatonTooLarge("letters", 1 << MAX_BITS)
    alphabet = TruthTables(len(atoms))
    numbers = {first: 0}
    order, moves = [first], []
    for state in order:
        if len(order) > MAX_STATES:
            raise AutomatonTooLarge("states", MAX_STATES)
        found: dict[tuple[int, int], int] = {}
        for letter in range(1 << len(atoms)):
            tick()
            for acceptance, target in step(state, letter):
                if target != BAD and target not in numbers:
                    numbers[target] = len(order)
                    order.append(target)
                key = (BAD if target == BAD else numbers[target], acceptance)
                found[key] = found.get(key, 0) | 1 << letter
        for (target, acceptance), letters in found.items():
            moves.append(TableMove(numbers[state], target, acceptance, tuple(cubes_of(alphabet, letters))))
    return Table(tuple(atoms), tuple(moves), len(order), sets)


def region(cubes: Sequence[Cube], atoms: Sequence[z3.BoolRef]) -> z3.BoolRef:
    """That the letter is in one of `cubes`."""
    found: list[z3.BoolRef] = []
    for positive, negative in cubes:
        literals = [a for i, a in enumerate(atoms) if positive >> i & 1]
        literals += [z3.Not(a) for i, a in enumerate(atoms) if negative >> i & 1]
        if not literals:
            return z3.BoolVal(True)
        found.append(literals[0] if len(literals) == 1 else z3.And(literals))
    return found[0] if len(found) == 1 else z3.Or(found)


def moved(
    table: Table,
    before: Sequence[z3.BoolRef],
    after: Sequence[z3.BoolRef],
    marks: Sequence[z3.BoolRef],
    letter: Mapping[str, z3.BoolRef],
    observed: z3.BoolRef,
) -> z3.BoolRef:
    """An automaton goes from a state to another by a letter, in the acceptance sets `marks`; it stays where none is
    shown. Of `before` and `after`, which have a Bool for each state, one each is true."""
    atoms = [letter[a] for a in table.atoms]
    taken = []
    for move in table.moves:
        if z3.is_false(before[move.source]):
            continue
        met = [m == bool(move.acceptance >> k & 1) for k, m in enumerate(marks)]
        taken.append(z3.And(before[move.source], region(move.cubes, atoms), after[move.target], *met))
    moves = z3.Or(taken)
    if z3.is_true(observed):
        return moves
    still = z3.And(*(a == b for a, b in zip(before, after, strict=True)), *(z3.Not(m) for m in marks))
    return z3.If(observed, moves, still)


class Watched:
    """A monitor beside a run: whether the letters up to each point are a bad prefix."""

    def __init__(self, table: Table, name: str, states: Sequence[z3.BoolRef] | None = None) -> None:
        """`states`: which one the monitor is in (the first, where None), one Bool for each."""
        self._table = table
        self._name = name
        self._numbers = count()
        self.states = [z3.BoolVal(i == 0) for i in range(table.states)] if states is None else list(states)
        self.constraints: list[z3.BoolRef] = []

    def add(self, letter: Mapping[str, z3.BoolRef], observed: z3.BoolRef) -> z3.BoolRef:
        """Read a point; true where its letter completes a bad prefix."""
        atoms = [letter[a] for a in self._table.atoms]
        into: dict[int, list[z3.BoolRef]] = {}
        for move in self._table.moves:
            if not z3.is_false(self.states[move.source]):
                into.setdefault(move.target, []).append(z3.And(self.states[move.source], region(move.cubes, atoms)))
        stay = z3.Not(observed)
        states = []
        for i, state in enumerate(self.states):
            moved = z3.Or(into.get(i, []))
            states.append(self._named(z3.If(stay, state, moved)))
        self.states = states
        return self._named(z3.And(observed, z3.Or(into.get(BAD, []))))

    def _named(self, term: z3.BoolRef) -> z3.BoolRef:
        simple = z3.simplify(term)
        if z3.is_const(simple):
            return simple
        name = z3.Bool(f"{OURS}{self._name}#{next(self._numbers)}")
        self.constraints.append(name == simple)
        return name


class AutomatonRun:
    """A run of an automaton beside one of the arrangement; it accepts where both go into a loop together."""

    def __init__(self, table: Table, name: str) -> None:
        self._table = table
        self._name = name
        self._states: list[list[z3.BoolRef]] = []
        self._met: list[z3.BoolRef] = [z3.BoolVal(False)] * table.acceptance_sets
        self.constraints: list[z3.BoolRef] = []

    def add(self, letter: Mapping[str, z3.BoolRef], observed: z3.BoolRef, loops: Loops) -> None:
        """Read a point; `loops` has it already."""
        table, point = self._table, len(self._states)
        before = self._states[-1] if self._states else [z3.BoolVal(i == 0) for i in range(table.states)]
        states = [z3.Bool(f"{OURS}{self._name}@{point}={i}") for i in range(table.states)]
        self.constraints.append(z3.PbEq([(s, 1) for s in states], 1))
        marks = [z3.Bool(f"{OURS}{self._name}@{point}!{k}") for k in range(table.acceptance_sets)]
        self.constraints.append(moved(table, before, states, marks, letter, observed))
        self._states.append(states)
        met_now = []
        for k, mark in enumerate(marks):
            name = z3.Bool(f"{OURS}{self._name}@{point}+{k}")
            self.constraints.append(name == z3.Or(self._met[k], z3.And(loops.inside[point], mark)))
            met_now.append(name)
        self._met = met_now

    def holds(self) -> z3.BoolRef:
        """True: whether the automaton accepts is a matter of the loop (`closed`)."""
        return z3.BoolVal(True)

    def closed(self, loops: Loops) -> list[z3.BoolRef]:
        """The run has a loop, on which the automaton is back in its state and has met every acceptance set."""
        found = [loops.exists, *self._met]
        last = self._states[-1]
        for number, start in loops.starts.items():
            same = z3.And([a == b for a, b in zip(self._states[number - 1], last, strict=True)])
            found.append(z3.Implies(start, same))
        return found
