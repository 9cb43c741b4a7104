"""Checks a certificate of `llfsm-verify --certificate` with the standard library and nothing of the model checker.

The certificate (docs/certificates.md) is not believed. The step program in it is executed here with exact integers, and
each verdict is shown anew: that a property holds by a set of product states that no step leaves, and ranks that no step
raises; that it is violated by a run that is taken step by step.

The names are those of Baier and Katoen, Principles of Model Checking: a *letter* is the set of atomic propositions that
are true at a point of a run, as the bits of a number; the letters of a run are its *trace*; a *lasso* is a trace that
ends in a part that repeats forever; the automata are generalised Büchi automata, which accept a trace if they have a
run on it that shows each acceptance set again and again; a *bad prefix* is a beginning of a trace after which a
property is violated, however the trace goes on.

What the sections of a certificate hold, beside the table of that page:

Program. `cells` are [name, lowest, highest, initial value, free]: those of a configuration, of the outputs of a step,
and of locals, arrays element by element; `sizes` says where the first two end. `choices` are [name, lowest, highest,
kind, input], `inputs` [name, cell, value in the first letter]. `terms` are expressions [operator, operand, …] whose
operands are earlier terms; `blocks` are lists of statements: `set` cell, term; `put` cell, size, index, term (an
element of an array); `sample` cell, choice; `if` term, block, block; `switch` term, [[value, block], …], block;
`fault` number, term; `do` block. `processes` are [name, cell that is 1 when it has ended, or null, block]; the block
is a whole step, the letter included. `letter` has the terms of the atoms in the initial configuration (`first`), the
cells whose values are the bits of a letter (`cells`: the atoms, then what fairness asks), the cell that tells the end
of a cycle, and the block of the stuttering step. `fairness` are [name, bit of the premise or null, bit of the goal],
`faults` [code, message, line].

Automata. Edges of state q are `edges[q]`: [positive, negative, target, acceptance], masks over `atoms`, which are
bits of letters; bit k of `acceptance` is acceptance set k, of which there are `sets`. State 0 is initial. In an
automaton that is `complete` a letter without an edge is an error, and an edge without a target (null) ends the run.
`bad` are the states after bad prefixes.

Properties. `violations` is the automaton of the violating runs, `early` that of the bad prefixes, `safe`: every
violation has one. `formula` is a list of [operator, operand, operand] with operators `atom` (a bit of letters),
`true`, `not`, `and`, `X`, `U`, `R`, null where the formula has others. `prefix` and `lasso` are proofs: `joint` lists
states of the automata side by side (assumptions, premises, the property's), `nodes` has three numbers for each
product state: configuration, index in `joint`, rank; `sets` names for each rank the acceptance set that is missing:
those of the automata in order, then one that every letter is in, then one for each fairness condition without a
premise. `run` is `initial`, `steps` [process or null, [[choice, value], …], configuration] and `loop`, the number of
steps before the part that repeats; `trail` the states of the automata after each letter. `reason`: why it is not
certified.
"""

from __future__ import annotations

import argparse
import json
import math
import operator
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple, TypeVar

FORMAT = "llfsm-certificate 1"
SECTIONS = (
    "format", "inputs", "program", "automata", "assumptions", "premises", "configurations", "steps", "faults",
    "properties",
)  # fmt: skip
TRUSTED = "Believed, not checked: program, formulas and automata are those of the files (--check-certificate compares)."

PROVED, REJECTED, UNWRITTEN, NOT_CERTIFIED = 0, 1, 3, 4
"""Exit codes."""

WORD = 1 << 128
"""Numbers of the program are from -WORD to WORD - 1: those on the way have up to 128 bits, with a sign or without."""

MOST_BITS = 1 << 12
"""No letter and no set of acceptance sets has more bits."""

DEEPEST = 100_000
"""How deep expressions and blocks may be nested."""

LARGEST_INPUT = 1 << 26
"""Input files of this many bytes or more are not compared."""


class Rejected(Exception):
    """What is wrong with the certificate, in a sentence."""


class Faulted(Exception):
    """A step ends in the fault of this number."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


# ---------------------------------------------------------------- reading
# A JSON document has values of any kind anywhere. These functions return a value of the kind that is asked for, or
# reject the certificate.

T = TypeVar("T")
KINDS: dict[type, str] = {int: "a number", str: "a text", list: "a list", dict: "an object", bool: "true or false"}


def typed(value: object, kind: type[T]) -> T:
    """A value of exactly this type: True is not an `int` here."""
    if type(value) is not kind:
        raise Rejected(f"something else is in the place of {KINDS[kind]}")
    return value


def inside(value: int, low: int, end: int) -> int:
    """A number from `low` to `end` - 1."""
    if not low <= value < end:
        raise Rejected(f"{str(value)[:30]} is not one of the possible numbers from {low} to {end - 1}")
    return value


def natural(value: object, end: int) -> int:
    """A number from 0 to `end` - 1."""
    return inside(typed(value, int), 0, end)


def index(value: object, sequence: Sequence[object]) -> int:
    """The place of an element."""
    return natural(value, len(sequence))


def word(value: object) -> int:
    """A number of the program."""
    return inside(typed(value, int), -WORD, WORD)


def items(value: object) -> list[object]:
    """A list."""
    return typed(value, list)


def rows(value: object) -> list[list[object]]:
    """A list of lists."""
    return [items(row) for row in items(value)]


def fields(value: object, *keys: str) -> list[object]:
    """The values that an object has for these keys, in this order; it has no others."""
    known = typed(value, dict)
    if set(known) != set(keys):
        raise Rejected(f"there is no object with the keys {' '.join(keys)}")
    return [known[key] for key in keys]


def canonical(value: object) -> str:
    """The one text of a value: keys in order, no spaces."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


# ---------------------------------------------------------------- expressions
# A step works on a list of numbers, the cells: variables, outputs and locals, arrays element by element. An expression
# becomes a Python function of the cells. Comparisons give 0 or 1 (or False and True, which are the same numbers).

Cells = list[int]
Expression = Callable[[Cells], int]


def negation(a: int) -> int:
    return 1 - a


def product_of_words(a: int, b: int) -> int:
    """Products stay in 128 bits: squares of squares would soon be too long to compute with."""
    return inside(a * b, -WORD, WORD)


def quotient(a: int, b: int) -> int:
    """Division rounds towards zero, as in C."""
    size = abs(a) // abs(b)
    return size if (a < 0) == (b < 0) else -size


def remainder(a: int, b: int) -> int:
    """What division leaves has the sign of the dividend, as in C."""
    size = abs(a) % abs(b)
    return -size if a < 0 else size


OF_ONE: dict[str, Callable[[int], int]] = {"neg": operator.neg, "not": negation, "abs": abs}
OF_TWO: dict[str, Callable[[int, int], int]] = {
    "add": operator.add, "sub": operator.sub, "mul": product_of_words, "div": quotient, "mod": remainder,
    "min": min, "max": max,
    "eq": operator.eq, "ne": operator.ne, "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge,
    "and": operator.and_, "or": operator.or_, "xor": operator.xor,
}  # fmt: skip


def expression_of(term: list[object], earlier: Sequence[Expression], cells: Sequence[object]) -> Expression:
    """The function of a term [operator, operand, …], whose operands are earlier terms."""
    match term:
        case ["const", number]:
            constant = word(number)
            return lambda _: constant
        case ["get", cell]:
            place = index(cell, cells)
            return lambda values: values[place]
        case ["element", cell, length, which]:
            return element_of(index(cell, cells), word(length), earlier[index(which, earlier)])
        case ["wrap", low, high, operand]:
            return wrapped(word(low), word(high), earlier[index(operand, earlier)])
        case ["ite", condition, first, second]:
            test = earlier[index(condition, earlier)]
            yes, no = earlier[index(first, earlier)], earlier[index(second, earlier)]
            return lambda values: yes(values) if test(values) else no(values)
        case [str(name), operand] if name in OF_ONE:
            change, inner = OF_ONE[name], earlier[index(operand, earlier)]
            return lambda values: change(inner(values))
        case [str(name), first, second] if name in OF_TWO:
            join, left, right = OF_TWO[name], earlier[index(first, earlier)], earlier[index(second, earlier)]
            return lambda values: join(left(values), right(values))
    raise Rejected("an expression has no such operator, or not so many operands")


def remembered(term: Expression) -> Expression:
    """The same, computed once for all places where it stands, as long as these cells are asked for, unchanged."""
    last: list[tuple[Cells, int]] = []

    def value(values: Cells) -> int:
        if not last or last[0][0] is not values:
            last[:] = [(values, term(values))]
        return last[0][1]

    return value


def element_of(first: int, length: int, which: Expression) -> Expression:
    """An element of the array whose first cell is `first`."""
    return lambda values: values[first + inside(which(values), 0, length)]


def wrapped(low: int, high: int, inner: Expression) -> Expression:
    """A value brought into the range from `low` to `high` by the modulus."""
    size = high + 1 - low
    return lambda values: (inner(values) - low) % size + low


# ---------------------------------------------------------------- statements
# A statement becomes a Python function that changes the cells, and that may read choices: inputs, and whatever else a
# step finds outside of the program.


class Choices:
    """The values of the choices in one step: those that were asked for, of others the lowest."""

    def __init__(self, ranges: Sequence[range], asked: dict[int, int]) -> None:
        self._ranges = ranges
        self._asked = asked
        self.read: dict[int, int] = {}
        """The choices that the step has read so far, in this order, with the values that it found."""

    def value(self, choice: int) -> int:
        if choice not in self.read:
            self.read[choice] = self._asked.get(choice, self._ranges[choice].start)
        return self.read[choice]


Statement = Callable[[Cells, Choices], None]


class Statements:
    """Makes functions of the statements of a program."""

    def __init__(self, ranges: Sequence[tuple[int, int]], choices: Sequence[range], faults: Sequence[object]) -> None:
        self._ranges = ranges
        self._choices = choices
        self._faults = faults
        self.terms: list[Expression] = []
        self.blocks: list[Statement] = []

    def add_term(self, term: list[object]) -> None:
        self.terms.append(expression_of(term, self.terms, self._ranges))

    def add_block(self, block: list[list[object]]) -> None:
        self.blocks.append(sequence_of([self._statement(row) for row in block]))

    def term(self, number: object) -> Expression:
        return self.terms[index(number, self.terms)]

    def block(self, number: object) -> Statement:
        return self.blocks[index(number, self.blocks)]

    def _statement(self, row: list[object]) -> Statement:
        match row:
            case ["set", cell, value]:
                place = index(cell, self._ranges)
                return assignment(place, self._ranges[place], self.term(value))
            case ["put", cell, length, which, value]:
                first = index(cell, self._ranges)
                return element_assignment(first, self._ranges[first], word(length), self.term(which), self.term(value))
            case ["sample", cell, choice]:
                return sampling(index(cell, self._ranges), index(choice, self._choices))
            case ["if", condition, first_block, second_block]:
                return branch(self.term(condition), self.block(first_block), self.block(second_block))
            case ["switch", value, table, other]:
                blocks = {word(key): self.block(number) for key, number in rows(table)}
                return switch(self.term(value), blocks, self.block(other))
            case ["fault", number, condition]:
                return fault(index(number, self._faults), self.term(condition))
            case ["do", number]:
                return self.block(number)
        raise Rejected("there is no such statement, or it has not so many operands")


def sequence_of(statements: Sequence[Statement]) -> Statement:
    """One statement after the other."""

    def run(cells: Cells, choices: Choices) -> None:
        for statement in statements:
            statement(cells, choices)

    return run


def assignment(cell: int, limits: tuple[int, int], value: Expression) -> Statement:
    """A value, inside the range of the cell."""
    low, end = limits

    def run(cells: Cells, _: Choices) -> None:
        cells[cell] = inside(value(cells), low, end)

    return run


def element_assignment(
    first: int, limits: tuple[int, int], length: int, which: Expression, value: Expression
) -> Statement:
    """The same for an element of the array whose first cell is `first`."""
    low, end = limits

    def run(cells: Cells, _: Choices) -> None:
        new = inside(value(cells), low, end)
        cells[first + inside(which(cells), 0, length)] = new

    return run


def sampling(cell: int, choice: int) -> Statement:
    def run(cells: Cells, choices: Choices) -> None:
        cells[cell] = choices.value(choice)

    return run


def branch(condition: Expression, yes: Statement, no: Statement) -> Statement:
    def run(cells: Cells, choices: Choices) -> None:
        if condition(cells):
            yes(cells, choices)
        else:
            no(cells, choices)

    return run


def switch(value: Expression, blocks: dict[int, Statement], other: Statement) -> Statement:
    def run(cells: Cells, choices: Choices) -> None:
        block = blocks.get(value(cells), other)
        block(cells, choices)

    return run


def fault(number: int, condition: Expression) -> Statement:
    def run(cells: Cells, _: Choices) -> None:
        if condition(cells):
            raise Faulted(number)

    return run


# ---------------------------------------------------------------- the transition system
# The states of the transition system are *nodes*: the values of a configuration, which are the first cells; where whole
# cycles are observed, in the middle of a cycle those of the outputs as well. Steps that end a cycle show a letter.

Node = tuple[int, ...]


class Step(NamedTuple):
    """Where a step leads: to a node and what it shows (None in the middle of a cycle), or to a fault."""

    node: Node | None
    letter: int | None
    fault: int | None
    read: dict[int, int]
    """The choices that it reads, in this order, with their values."""


class Process(NamedTuple):
    ended: int | None
    """The cell that is 1 when the process has ended."""
    step: Statement


class Fairness(NamedTuple):
    """If the premise is true again and again, so is the goal: bits of letters. None: whatever is true."""

    premise: int | None
    goal: int


class Program:
    """The step program: initial nodes, and the steps from any node."""

    def __init__(self, data: object) -> None:
        _, observe, sizes, cells, choices, inputs, terms, blocks, processes, letter, fairness, faults = fields(
            data, "name", "observe", "sizes", "cells", "choices", "inputs", "terms", "blocks", "processes", "letter",
            "fairness", "faults",
        )  # fmt: skip
        if typed(observe, str) not in ("ringlet", "cycle"):
            raise Rejected("neither ringlets nor cycles are observed")
        self.whole_cycles = observe == "cycle"
        self._read_cells(cells, sizes)
        self.choices = [range(word(low), word(high) + 1) for _, low, high, *_ in rows(choices)]
        self.faults = items(faults)
        code = Statements(self.ranges, self.choices, self.faults)
        once: list[Expression] = []
        for term in rows(terms):
            code.add_term(term)
            once.append(remembered(expression_of(term, once, self.ranges)))
        for block in items(blocks):
            code.add_block(rows(block))
        self._read_letter(letter, code, once)
        self.first_inputs = [(index(cell, self.initial), word(value)) for _, cell, value, *_ in rows(inputs)]
        self.fairness = [self._fairness_of(premise, goal) for _, premise, goal in rows(fairness)]
        self.processes = [self._process_of(ended, code.block(block)) for _, ended, block in rows(processes)]

    def _read_cells(self, cells: object, sizes: object) -> None:
        """`ranges` and `initial` values of all cells; which of a configuration are `free`: initially any value."""
        self.ranges: list[tuple[int, int]] = []
        self.initial: list[int] = []
        free: list[bool] = []
        for _, low, high, value, may_be_any in rows(cells):
            limits = word(low), word(high) + 1
            self.ranges.append(limits)
            self.initial.append(inside(word(value), *limits))
            free.append(typed(may_be_any, bool))
        of_configuration, with_outputs = items(sizes)
        self.width = natural(of_configuration, len(self.initial) + 1)
        self.width_in_cycle = natural(with_outputs, len(self.initial) + 1)
        self.free = free[: self.width]

    def _read_letter(self, data: object, code: Statements, terms: Sequence[Expression]) -> None:
        """What a letter shows: the terms of the first one, and the cells of the others."""
        first, cells, cycle, stutter = fields(data, "first", "cells", "cycle", "stutter")
        self.first_atoms = [terms[index(term, terms)] for term in items(first)]
        self.shown = [index(cell, self.initial) for cell in items(cells)]
        self.cycle_ends = index(cycle, self.initial)
        self.stutter = code.block(stutter)

    def _fairness_of(self, premise: object, goal: object) -> Fairness:
        return Fairness(None if premise is None else index(premise, self.shown), index(goal, self.shown))

    def _process_of(self, ended: object, step: Statement) -> Process:
        return Process(None if ended is None else index(ended, self.initial), step)

    def node(self, values: object) -> Node:
        """A node as the certificate writes it, each value inside the range of its variable."""
        numbers = items(values)
        in_cycle = self.whole_cycles and len(numbers) > self.width
        ranges = self.ranges[: self.width_in_cycle if in_cycle else self.width]
        return tuple(inside(typed(x, int), low, end) for x, (low, end) in zip(numbers, ranges, strict=True))

    def count_of_initial(self) -> int:
        """How many initial configurations there are."""
        return math.prod(end - low for (low, end), free in zip(self.ranges, self.free, strict=False) if free)

    def is_initial(self, node: Node) -> bool:
        if len(node) != self.width:
            return False
        return all(free or x == y for x, y, free in zip(node, self.initial, self.free, strict=False))

    def first_letter(self, node: Node) -> int:
        """The letter of an initial configuration, in which inputs have the values that they have at first."""
        cells = self._cells_of(node)
        for cell, value in self.first_inputs:
            cells[cell] = value
        return sum(1 << bit for bit, atom in enumerate(self.first_atoms) if atom(cells))

    def _cells_of(self, node: Node) -> Cells:
        return [*node, *self.initial[len(node) :]]

    def enabled(self, node: Node) -> list[int | None]:
        """The processes that can take a step; None alone where all have ended: nothing changes any more."""
        able: list[int | None] = []
        for number, process in enumerate(self.processes):
            if process.ended is None or not node[process.ended]:
                able.append(number)
        return able or [None]

    def step(self, node: Node, process: int | None, asked: dict[int, int]) -> Step:
        """The step of a process (None: the stuttering step) with the values that are asked for."""
        cells = self._cells_of(node if process is not None else node[: self.width])
        choices = Choices(self.choices, asked)
        take = self.stutter if process is None else self.processes[process].step
        try:
            take(cells, choices)
        except Faulted as end:
            return Step(None, None, end.number, choices.read)
        if self.whole_cycles and process is not None and not cells[self.cycle_ends]:
            return Step(tuple(cells[: self.width_in_cycle]), None, None, choices.read)
        letter = sum(1 << bit for bit, cell in enumerate(self.shown) if cells[cell])
        return Step(tuple(cells[: self.width]), letter, None, choices.read)

    def successors(self, node: Node) -> Iterator[Step]:
        """Every step: of each process, with all values of the choices that it reads."""
        for process in self.enabled(node):
            asked: dict[int, int] | None = {}
            while asked is not None:
                step = self.step(node, process, asked)
                yield step
                asked = self._next_values(step.read)

    def _next_values(self, read: dict[int, int]) -> dict[int, int] | None:
        """The values to ask for next, as an odometer counts; None after the last.

        The last choice that can rises; those that were read after it begin anew, if they are read at all."""
        wheels = list(read.items())
        while wheels:
            choice, value = wheels.pop()
            if value + 1 in self.choices[choice]:
                return dict([*wheels, (choice, value + 1)])
        return None


# ---------------------------------------------------------------- formulas on a lasso
# A formula is a list of [operator, operand, operand], whose operands are earlier formulas. It is evaluated by the
# definition: one after the other, at every position of the lasso.


def true_on(formula: object, letters: Sequence[int], back: int) -> bool:
    """Whether a formula is true of the lasso whose last letter is followed by letter number `back`."""
    following = [*range(1, len(letters)), back]
    known: list[list[bool]] = []
    for name, first, second in rows(formula):
        if name == "true":
            truth = [True] * len(letters)
        elif name == "atom":
            bit = natural(first, MOST_BITS)
            truth = [bool(letter >> bit & 1) for letter in letters]
        else:
            a, b = known[index(first, known)], known[index(second, known)]
            truth = true_where(name, a, b, following)
        known.append(truth)
    return known[-1][0]


def true_where(name: object, a: list[bool], b: list[bool], following: list[int]) -> list[bool]:
    """Where a formula is true: its operands are true at the positions `a` and `b`, `following` is the next position."""
    match name:
        case "not":
            return [not p for p in a]
        case "and":
            return [p and q for p, q in zip(a, b, strict=True)]
        case "X":
            return [a[k] for k in following]
        case "U":
            return until(a, b, following)
        case "R":  # p R q is the dual of U: !(!p U !q)
            violated = until([not p for p in a], [not q for q in b], following)
            return [not p for p in violated]
    raise Rejected("a formula has no such operator")


def until(a: list[bool], b: list[bool], following: list[int]) -> list[bool]:
    """Where a U b is true: the least solution of truth = b || (a && X truth).

    Two sweeps from the end are enough: the second takes what the first has found at the start of the loop to its end.
    """
    truth = [False] * len(a)
    for _ in range(2):
        for i in reversed(range(len(a))):
            truth[i] = b[i] or (a[i] and truth[following[i]])
    return truth


# ---------------------------------------------------------------- automata
# The generalised Büchi automata of the assumptions, of fairness and of the property's violations read a trace together:
# they are kept side by side, as their synchronous product. State 0 of each is initial.


class Edge(NamedTuple):
    positive: int
    """Atoms that are to be true, and in `negative` false, as masks."""
    negative: int
    target: int | None
    """None: it is known that there is no move."""
    acceptance: int
    """The acceptance sets that the edge belongs to."""


class Automaton:
    """One automaton, as the certificate writes it."""

    def __init__(self, data: object) -> None:
        _, atoms, sets, complete, bad, edges = fields(data, "about", "atoms", "sets", "complete", "bad", "edges")
        self.atoms = [natural(atom, MOST_BITS) for atom in items(atoms)]
        self.sets = natural(sets, MOST_BITS)
        self.complete = typed(complete, bool)
        self.edges: list[list[Edge]] = []
        states = items(edges)
        for row in states:
            self.edges.append([self._edge(edge, states) for edge in rows(row)])
        self.bad = {index(state, states) for state in items(bad)}

    def _edge(self, edge: list[object], states: list[object]) -> Edge:
        positive, negative, target, acceptance = edge
        return Edge(
            natural(positive, 1 << MOST_BITS),
            natural(negative, 1 << MOST_BITS),
            None if target is None else index(target, states),
            natural(acceptance, 1 << self.sets),
        )

    def moves(self, state: int, letter: int) -> list[Edge]:
        """The edges of a state that can read a letter."""
        true = sum(1 << place for place, bit in enumerate(self.atoms) if letter >> bit & 1)
        fitting = [e for e in self.edges[state] if e.positive & ~true == 0 and e.negative & true == 0]
        if self.complete and not fitting:
            raise Rejected("an automaton does not say what it does with a letter that occurs")
        return [edge for edge in fitting if edge.target is not None]


JointState = tuple[int, ...]


class Move(NamedTuple):
    """A move of all automata."""

    target: JointState
    acceptance: int
    """The acceptance sets of the product that it shows."""


class Product:
    """Automata side by side. Their acceptance sets, as bits: those of each automaton in order; one that every letter
    belongs to; for each of `goals` one that the letters belong to in which this bit is set."""

    def __init__(self, automata: Sequence[object], goals: Sequence[int]) -> None:
        self.automata = [Automaton(data) for data in automata]
        self.goals = goals
        self.own_sets = sum(automaton.sets for automaton in self.automata)
        self.sets = self.own_sets + 1 + len(goals)
        self.every_set = (1 << self.sets) - 1
        self._known: dict[tuple[JointState, int], list[Move]] = {}

    def state(self, numbers: object) -> JointState:
        """A state as the certificate writes it: one of each automaton."""
        pairs = zip(items(numbers), self.automata, strict=True)
        return tuple(index(number, automaton.edges) for number, automaton in pairs)

    def first_moves(self, letter: int) -> list[Move]:
        """The moves from the initial states. None where an automaton has no states at all: it accepts nothing."""
        if not all(automaton.edges for automaton in self.automata):
            return []
        return self.moves((0,) * len(self.automata), letter)

    def moves(self, states: JointState, letter: int | None) -> list[Move]:
        """The common moves on a letter; in the middle of a cycle there is none, and the automata wait."""
        if letter is None:
            return [Move(states, 0)]
        known = self._known.get((states, letter))
        if known is None:
            known = self._known[states, letter] = self._joint_moves(states, letter)
        return known

    def _joint_moves(self, states: JointState, letter: int) -> list[Move]:
        found = [Move((), self._shown_by(letter))]
        shift = 0
        for automaton, state in zip(self.automata, states, strict=True):
            longer: list[Move] = []
            for edge in automaton.moves(state, letter):
                if edge.target is not None:
                    own = edge.acceptance << shift
                    longer += [Move((*move.target, edge.target), move.acceptance | own) for move in found]
            found = longer
            shift += automaton.sets
        return found

    def _shown_by(self, letter: int) -> int:
        """The acceptance sets that a letter belongs to, whatever the automata do."""
        shown = 1 << self.own_sets
        for place, bit in enumerate(self.goals, self.own_sets + 1):
            if letter >> bit & 1:
                shown |= 1 << place
        return shown


# ---------------------------------------------------------------- the certificate


class Assumption(NamedTuple):
    name: object
    text: object
    formula: object
    automaton: object


class Property(NamedTuple):
    """What is claimed of a property (docs/certificates.md)."""

    formula: object
    """Or None, where it is not one of plain temporal logic."""
    early: object
    """The automaton of the bad prefixes, or None."""
    violating: object
    """The automaton of the violating traces, or None: that of the bad prefixes, if each violation has one."""
    safe: bool
    """Each violation has a bad prefix."""
    prefix: object
    lasso: object
    """Proofs that it holds, or None: that there is no bad prefix, and no violating lasso."""
    run: object
    trail: object
    """The run that violates it, or None, and the states of the automata after each of its letters."""


class Run(NamedTuple):
    """A run that was taken again."""

    letters: list[int]
    back: int | None
    """The number of the letter that follows the last one; None: it is no lasso."""
    fault: int | None
    """The fault that it ends in."""


class Proof(NamedTuple):
    """A proof that something never happens; `bad` are the states after bad prefixes, which are not to be reached."""

    product: Product
    data: object
    bad: set[int]


Claim = tuple[str, str | None]
"""What is claimed, in words, and what has proved it; None: it is not certified."""


class Certificate:
    """What a certificate claims. Making one checks its program, configurations and faults; `prove` a property."""

    def __init__(self, document: object) -> None:
        self._check_digests(document)
        (
            _, self.inputs, program, automata, assumptions, premises, configurations, steps, faults, self.properties,
        ) = [typed(document, dict)[name] for name in SECTIONS]  # fmt: skip
        self.program = Program(program)
        self.automata = items(automata)
        self.assumptions = [
            Assumption(*fields(each, "name", "text", "formula", "automaton")) for each in items(assumptions)
        ]
        self._read_premises(items(premises))
        self.steps = typed(steps, int)
        self.explored = configurations is not None
        self.edges: list[list[tuple[int, int | None]]] = []
        """Of each configuration the steps from it: the number of a configuration, and the letter that is shown."""
        self.first: list[tuple[int, int]] = []
        """The numbers of the initial configurations, and their letters."""
        self.faults: set[int] = set()
        """The faults that steps end in."""
        self.in_cycles = 0
        """How many nodes are in the middle of an observed cycle."""
        if self.explored:
            self._check_configurations(items(configurations))
        self.about_faults = self._prove_faults(faults)

    def _check_digests(self, document: object) -> None:
        *sections, digests = fields(document, *SECTIONS, "digests")
        if sections[0] != FORMAT:
            raise Rejected(f"its format is not `{FORMAT}`, the only one that this program reads")
        hashes = [sha256(canonical(section).encode()).hexdigest() for section in sections]
        if digests != dict(zip(SECTIONS, hashes, strict=True)):
            raise Rejected("a part of it is not the one whose hash it has")

    def _read_premises(self, premises: list[object]) -> None:
        """What every run is known to satisfy: automata of the assumptions and of fairness with a premise, and as
        acceptance sets the goals of fairness without a premise."""
        fairness = self.program.fairness
        if len(premises) != sum(1 for condition in fairness if condition.premise is not None):
            raise Rejected("fairness has more premises than automata, or fewer")
        numbers = [*(assumption.automaton for assumption in self.assumptions), *premises]
        self.given = [self._automaton(number) for number in numbers]
        self.goals = [condition.goal for condition in fairness if condition.premise is None]

    def _automaton(self, number: object) -> object:
        return self.automata[index(number, self.automata)]

    # ------------------------------------------------------------ configurations

    def _check_configurations(self, listed: list[object]) -> None:
        """All initial configurations are there, and every one that a step from one of them leads to."""
        numbers = {self.program.node(values): number for number, values in enumerate(listed)}
        self.in_cycles = sum(len(node) > self.program.width for node in numbers)
        for node, number in numbers.items():
            if self.program.is_initial(node):
                self.first.append((number, self.program.first_letter(node)))
        left = self.steps
        for node in numbers:
            left -= self._check_steps(node, numbers, left)
        twice = len(numbers) < len(listed)
        if left or twice or len(self.first) != self.program.count_of_initial():
            raise Rejected("there are too few steps, an initial configuration is missing, or one is there twice")

    def _check_steps(self, node: Node, numbers: dict[Node, int], most: int) -> int:
        """How many steps a node has, `most` at most; each ends in a fault, or leads to a node that is there."""
        count = 0
        found: dict[tuple[int, int | None], None] = {}  # in order, each once
        for step in self.program.successors(node):
            count += 1
            if count > most or (step.node is not None and step.node not in numbers):
                raise Rejected("a step leads to a configuration that is not there, or there are too many steps")
            if step.node is not None:
                found[numbers[step.node], step.letter] = None
            elif step.fault is not None:
                self.faults.add(step.fault)
        self.edges.append(list(found))
        return count

    # ------------------------------------------------------------ runs

    def _run(self, data: object) -> Run:
        """A run, taken again step by step."""
        initial, steps, loop = fields(data, "initial", "steps", "loop")
        node = self.program.node(initial)
        if not self.program.is_initial(node):
            raise Rejected("a run does not begin in an initial configuration")
        letters = [self.program.first_letter(node)]
        places = [(node, len(letters))]  # after each step: where the run is, and the number of the letter that follows
        fault: int | None = None
        for process, choices, values in rows(steps):
            if fault is not None:
                raise Rejected("a run takes a step that is not possible there")
            step = self._step_of_run(node, process, choices, values)
            fault = step.fault
            node = node if step.node is None else step.node
            if step.letter is not None:
                letters.append(step.letter)
            places.append((node, len(letters)))
        if loop is None:
            return Run(letters, None, fault)
        start, back = places[index(loop, places)]
        if start != node or back == len(letters) or fault is not None:
            raise Rejected("the loop of a run does not come back, or shows nothing")
        return Run(letters, back, None)

    def _step_of_run(self, node: Node, process: object, choices: object, values: object) -> Step:
        """The step of a process with these values of the choices, which leads where the run says: None for a fault."""
        mover = None if process is None else typed(process, int)
        if mover not in self.program.enabled(node):
            raise Rejected("a run takes a step that is not possible there")
        asked = [(index(choice, self.program.choices), word(value)) for choice, value in rows(choices)]
        step = self.program.step(node, mover, dict(asked))
        possible = all(value in self.program.choices[choice] for choice, value in asked)
        target = None if values is None else self.program.node(values)
        if not possible or list(step.read.items()) != asked or step.node != target:
            raise Rejected("a run does not come where it says, or reads other choices than it says")
        return step

    # ------------------------------------------------------------ faults

    def _prove_faults(self, data: object) -> Claim:
        verdict, reason, runs = fields(data, "verdict", "reason", "runs")
        shown = 0
        for number, run in rows(runs):
            if self._run(run).fault != index(number, self.program.faults):
                raise Rejected("what it says of faults is not proved")
            shown += 1
        if reason is not None:
            return f"{verdict}  faults: {reason}", None
        if typed(verdict, str) == "violated" and shown:
            return f"{verdict}  faults", f"runs: {shown}"
        if verdict == "holds" and not shown and self.explored and not self.faults:
            return f"{verdict}  faults", "every step"
        raise Rejected("what it says of faults is not proved")

    # ------------------------------------------------------------ properties

    def prove(self, data: object) -> Claim:
        """The verdict of a property, and what has proved it."""
        name, kind, text, formula, verdict, reason, violations, early, safe, prefix, lasso, run, trail = fields(
            data, "name", "kind", "text", "formula", "verdict", "reason", "violations", "early", "safe", "prefix",
            "lasso", "run", "trail",
        )  # fmt: skip
        condition = " on fault-free runs" if verdict == "holds" and self.faults else ""
        of_kind = "" if kind == "ltl" else f"{kind} "
        claim = f"{typed(verdict, str)}{condition}  {typed(name, str)}  {of_kind}{text}"
        if reason is not None:
            return f"{claim}: {typed(reason, str)}", None
        of_prefixes = None if early is None else self._automaton(early)
        of_violations = None if violations is None else self._automaton(violations)
        violating = of_prefixes if typed(safe, bool) else of_violations
        claimed = Property(formula, of_prefixes, violating, typed(safe, bool), prefix, lasso, run, trail)
        if verdict == "holds":
            return claim, f"{self._prove_that_it_holds(claimed):,} product states"
        if verdict == "violated":
            return claim, f"a run of {self._prove_violation(claimed):,} letters"
        raise Rejected("a verdict is neither `holds` nor `violated`")

    # ------------------------------------------------------------ what holds

    def _product(self, violating: object) -> Product:
        """What accepts the traces that violate a property and that are possible under the assumptions and fairness."""
        return Product([*self.given, violating], self.goals)

    def _prove_that_it_holds(self, claimed: Property) -> int:
        """The number of product states in the proofs.

        Without assumptions no bad prefix may occur; where each violation has one, that is all. Else no run may be
        accepted by the automata of the violations, the assumptions and fairness.
        """
        if claimed.violating is None or claimed.run is not None or claimed.trail is not None:
            raise Rejected("a property that holds has a run, or no automaton of its violations")
        proofs: list[Proof] = []
        if claimed.early is not None and not self.assumptions:
            alone = Product([claimed.early], [])
            proofs.append(Proof(alone, claimed.prefix, alone.automata[0].bad))
        elif claimed.prefix is not None:
            raise Rejected("there is a proof about bad prefixes, of which nothing is asked")
        if not proofs or not claimed.safe:
            proofs.append(Proof(self._product(claimed.violating), claimed.lasso, set()))
        elif claimed.lasso is not None:
            raise Rejected("there is a proof about lassos, of which nothing is asked")
        return sum(self._check_ranks(*proof) for proof in proofs)

    def _check_ranks(self, product: Product, data: object, bad: set[int]) -> int:
        """The number of product states: no step leaves them, none raises the rank, and within each rank the acceptance
        set that is named for it does not occur.

        So in a run the rank changes finitely often, and in the last one an acceptance set is missing forever: the
        automata do not accept it.
        """
        joint, nodes, named = (items(part) for part in fields(data, "joint", "nodes", "sets"))
        states = [product.state(numbers) for numbers in joint]
        missing = [1 << natural(number, product.sets) for number in named]
        rank_of = self._ranks(states, nodes, missing)
        if not self.explored or any(state[0] in bad for _, state in rank_of):
            raise Rejected("something is there twice or for nothing, or comes after a bad prefix")
        for configuration, letter in self.first:
            for move in product.first_moves(letter):
                if (configuration, move.target) not in rank_of:
                    raise Rejected("an initial product state is missing")
        for (configuration, state), rank in rank_of.items():
            for target, shown in self.edges[configuration]:
                for to, acceptance in product.moves(state, shown):
                    after = rank_of.get((target, to))
                    if after is None or after > rank or (after == rank and acceptance & missing[rank]):
                        raise Rejected("a product state is missing, or the ranks do not prove what they should")
        return len(rank_of)

    def _ranks(
        self, states: list[JointState], nodes: list[object], missing: list[int]
    ) -> dict[tuple[int, JointState], int]:
        """The rank of each product state, a configuration beside a state of the automata; nothing is there twice, or
        for nothing."""
        rank_of: dict[tuple[int, JointState], int] = {}
        used_states: set[int] = set()
        for configuration, state, rank in zip(nodes[::3], nodes[1::3], nodes[2::3], strict=True):
            number = index(state, states)
            used_states.add(number)
            rank_of[index(configuration, self.edges), states[number]] = index(rank, missing)
        twice = 3 * len(rank_of) < len(nodes)
        if twice or len(used_states) < len(states) or len(set(rank_of.values())) < len(missing):
            raise Rejected("something is there twice or for nothing, or comes after a bad prefix")
        return rank_of

    # ------------------------------------------------------------ what is violated

    def _prove_violation(self, claimed: Property) -> int:
        """The number of letters of the run that violates the property."""
        run = self._run(claimed.run)
        if claimed.prefix is not None or claimed.lasso is not None or run.fault is not None:
            raise Rejected("the run does not violate it")
        if run.back is None:
            fine = self._is_bad_prefix(claimed, run.letters)
        else:
            fine = self._is_violating_lasso(claimed, run.letters, run.back)
        if not fine:
            raise Rejected("the run does not violate it")
        return len(run.letters)

    def _is_bad_prefix(self, claimed: Property, letters: list[int]) -> bool:
        """The automaton of the bad prefixes says so; and the formula, where there is one, is false however the run goes
        on: here with any letter of the run, none or all atoms, forever."""
        if claimed.early is None or self.assumptions:
            return False
        alone = Product([claimed.early], [])
        states, _ = self._follow(alone, letters, claimed.trail)
        if states[-1][0] not in alone.automata[0].bad:
            return False
        if claimed.formula is None:
            return True
        last_letters = {0, (1 << len(self.program.shown)) - 1, *letters}
        return not any(true_on(claimed.formula, [*letters, last], len(letters)) for last in last_letters)

    def _is_violating_lasso(self, claimed: Property, letters: list[int], back: int) -> bool:
        """The automata accept it, and by the definition the assumptions are true and the property false, where they are
        formulas."""
        if claimed.violating is None:
            return False
        product = self._product(claimed.violating)
        states, acceptance = self._follow(product, letters, claimed.trail)
        if states[-1] != states[back - 1]:
            return False
        in_loop = 0
        for shown in acceptance[back:]:
            in_loop |= shown
        if in_loop != product.every_set:
            return False
        for assumption in self.assumptions:
            if assumption.formula is not None and not true_on(assumption.formula, letters, back):
                return False
        return claimed.formula is None or not true_on(claimed.formula, letters, back)

    def _follow(self, product: Product, letters: list[int], trail: object) -> tuple[list[JointState], list[int]]:
        """The states of the automata after each letter, as `trail` says, and the acceptance sets that are shown on the
        way. Where several moves lead to the same state all of theirs count: a loop can take one after the other."""
        states: list[JointState] = []
        acceptance: list[int] = []
        for letter, numbers in zip(letters, items(trail), strict=True):
            possible = product.moves(states[-1], letter) if states else product.first_moves(letter)
            after = tuple(word(number) for number in items(numbers))
            taken = [move for move in possible if move.target == after]
            if not taken:
                raise Rejected("the automata do not go where they are said to")
            shown = 0
            for move in taken:
                shown |= move.acceptance
            states.append(after)
            acceptance.append(shown)
        return states, acceptance


# ---------------------------------------------------------------- files


def read(path: Path) -> object:
    """What is in a file, in the one form that a certificate can have."""
    text = path.read_text(encoding="utf-8")
    document = json.loads(text)
    if canonical(document) + "\n" != text:
        raise Rejected("it is not in the one form of a certificate: keys in order, once each, no spaces")
    return document


def compare_inputs(inputs: object, folder: Path) -> tuple[int, int]:
    """How many of the input files are in `folder` and have the hash that is given, and of how many."""
    found, listed = 0, rows(inputs)
    for name, _, digest in listed:
        path = folder / typed(name, str)
        if path.exists() and path.stat().st_size < LARGEST_INPUT:
            compare_input(path, digest)
            found += 1
    return found, len(listed)


def compare_input(path: Path, digest: object) -> None:
    """Nothing is waited for: neither a pipe, nor a file that blocks in /proc, of which the size is 0."""
    if not path.is_file():  # to open a device can already do something
        raise Rejected("an input is not a regular file")
    with open(path, "rb", opener=open_without_waiting) as file:
        if not path.is_file() or sha256(file.read(path.stat().st_size)).hexdigest() != digest:
            raise Rejected("an input file is not the one of which it was made, or is not a regular file")


def open_without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


# ---------------------------------------------------------------- the command


def checked(path: Path, folder: Path) -> tuple[list[str], int]:
    """What a file proves, line by line, what is believed, and the exit code; `folder`: where the input files are."""
    limit = sys.getrecursionlimit()
    try:
        return answer(path, folder)
    except Rejected as error:
        return [f"rejected: {error}"], REJECTED
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - whatever fails, nothing is proved
        return [f"rejected: it cannot be read, is not well formed, or took too long ({error!r:.100})"], REJECTED
    finally:
        sys.setrecursionlimit(limit)


def answer(path: Path, folder: Path) -> tuple[list[str], int]:
    document = read(path)
    sys.setrecursionlimit(DEEPEST)  # an expression in an expression, and a block in a block, is a call in a call
    certificate = Certificate(document)
    found, listed = compare_inputs(certificate.inputs, folder)
    claims = [*(certificate.prove(each) for each in items(certificate.properties)), certificate.about_faults]
    lines = [f"assuming  {assumption.name}  {assumption.text}" for assumption in certificate.assumptions]
    for claim, why in claims:
        lines.append(f"not certified  {claim}" if why is None else f"proved  {claim}  ({why})")
    inside = f", {certificate.in_cycles:,} of them inside cycles" if certificate.in_cycles else ""
    counted = f"{len(certificate.edges):,} configurations{inside}, {certificate.steps:,} steps"
    lines.append(f"{counted}; {found} of {listed} inputs compared")
    lines.append(TRUSTED)
    all_proved = all(why is not None for _, why in claims)
    return [printable(line) for line in lines], PROVED if all_proved else NOT_CERTIFIED


def printable(line: str) -> str:
    """No text of the certificate ends a line, or does anything else to a terminal."""
    return "".join(c if c.isprintable() else " " for c in line)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its exit code: 0 all is proved, 1 rejected, 2 usage, 3 no answer could be written, 4 not all is
    certified."""
    parser = argparse.ArgumentParser("llfsm-check-certificate", description="Check a certificate of llfsm-verify.")
    parser.add_argument("certificate", metavar="FILE", type=Path, help="what llfsm-verify --certificate wrote")
    parser.add_argument("--inputs", metavar="DIR", help="where the input files are (default: where FILE says)")
    options = parser.parse_args(arguments)
    lines, code = checked(options.certificate, Path(options.inputs or options.certificate.parent))
    try:
        print(*lines, sep="\n", flush=True)  # noqa: T201 - nothing, where standard output is closed
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python tries once more when it ends
        parser.exit(UNWRITTEN, f"the answer cannot be written: {error.strerror}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
