"""Formulas and automata as certificates write them; automata that are made on demand as far as they were asked."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import reduce

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.product_search import Projection, Reader
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.bounds import without_steps
from llfsm_verify.logic.formula import Formula, is_plain, postorder


def formula_json(formula: Formula | None, bits: Mapping[str, int]) -> Json:
    """[operator, operand, operand] of each subformula, operands by the index of earlier ones (twice for unary ones).

    ["atom", bit, 0] is a bit of the letters. None for what is not plain temporal logic: past, bounds in time, regular
    expressions.
    """
    if formula is None:
        return None
    plain = without_steps(formula)
    return _Writer(bits).written(plain) if is_plain(plain) else None


class _Writer:
    def __init__(self, bits: Mapping[str, int]) -> None:
        self._bits = bits
        self._nodes: list[Json] = []
        self._known: dict[tuple[str, int, int], int] = {}

    def written(self, formula: Formula) -> list[Json]:
        done: dict[Formula, int] = {}
        for node in postorder(formula):
            done[node] = self._node(node, [done[a] for a in node.args])
        return self._nodes  # the last one is the formula: the others are parts of it

    def _add(self, op: str, a: int, b: int) -> int:
        number = self._known.setdefault((op, a, b), len(self._nodes))
        if number == len(self._nodes):
            self._nodes.append([op, a, b])
        return number

    def _not(self, a: int) -> int:
        return self._add("not", a, a)

    def _or(self, a: int, b: int) -> int:
        return self._not(self._add("and", self._not(a), self._not(b)))

    def _true(self) -> int:
        return self._add("true", 0, 0)

    def _node(self, node: Formula, args: list[int]) -> int:
        a, b = (args[0], args[-1]) if args else (0, 0)
        match node.op:
            case "true":
                return self._true()
            case "false":
                return self._not(self._true())
            case "atom":
                return self._add("atom", self._bits[node.key], 0)
            case "not":
                return self._not(a)
            case "and":
                return reduce(lambda x, y: self._add("and", x, y), args)
            case "or":
                return reduce(self._or, args)
            case "implies":
                return self._or(self._not(a), b)
            case "iff" | "xor":
                same = self._or(self._add("and", a, b), self._add("and", self._not(a), self._not(b)))
                return same if node.op == "iff" else self._not(same)
            case "X":
                return self._add("X", a, a)
            case "F":
                return self._add("U", self._true(), a)
            case "G":
                return self._add("R", self._not(self._true()), a)
            case "U" | "R":
                return self._add(node.op, a, b)
            case "W":  # a W b = b R (b || a)
                return self._add("R", b, self._or(b, a))
            case "M":  # a M b = b U (b && a)
                return self._add("U", b, self._add("and", b, a))
        raise AssertionError(node.op)


MOST_ROWS = 2_000
"""Moves of a monitor that are written beyond those that a proof needs."""


class RecordedAutomaton:
    """An automaton made on demand, with a memory of what it was asked."""

    def __init__(self, automaton: Lazy) -> None:
        self._automaton = automaton
        self.relevant = automaton.relevant
        self.acceptance_sets = automaton.acceptance_sets
        self.is_empty = automaton.is_empty
        self.rows: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {}

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of each move."""
        key = state, letter & self.relevant
        found = self.rows.get(key)
        if found is None:
            found = self.rows[key] = self._automaton(state, letter)
        return found


class MonitorAutomaton:
    """A monitor as an automaton of the words with a bad prefix: its one acceptance set is what comes after one.

    State 0 is initial; `bad` is the state after a bad prefix, None as long as there was none.
    """

    acceptance_sets = 1
    is_empty = False

    def __init__(self, monitor: PrefixMonitor, atoms: int) -> None:
        self._monitor = monitor
        self.relevant = (1 << atoms) - 1
        self._numbers: dict[int | None, int] = {}
        self._states: list[int | None] = []
        self._number(monitor.initial())

    @property
    def bad(self) -> int | None:
        return self._numbers.get(None)

    @property
    def states(self) -> int:
        """States numbered so far."""
        return len(self._states)

    def _number(self, state: int | None) -> int:
        number = self._numbers.setdefault(state, len(self._states))
        if number == len(self._states):
            self._states.append(state)
        return number

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of the one move."""
        here = self._states[state]
        following = None if here is None else self._monitor.step(here, letter)
        return ((int(following is None), self._number(following)),)


class Shelf:
    """The automata of a certificate, each once, with the numbers by which proofs name them."""

    def __init__(self, bits: Mapping[str, int]) -> None:
        """`bits`: the bit of each atom in the letters."""
        self._bits = bits
        self._numbers: dict[Hashable, int] = {}
        self._readers: list[Reader] = []
        self._atoms: list[tuple[str, ...]] = []
        self._about: list[str] = []
        self._monitors: dict[int, MonitorAutomaton] = {}
        self._watched: dict[int, RecordedAutomaton] = {}

    def place(self, what: Hashable, about: str, atoms: Sequence[str], make: Callable[[], Automaton | Lazy]) -> int:
        """The number of the automaton of `what` over `atoms`; `make` makes it the first time. AutomatonTooLarge."""
        number = self._numbers.get(what)
        if number is None:
            automaton = make()
            number = self._numbers[what] = len(self._readers)
            if isinstance(automaton, MonitorAutomaton):
                self._monitors[number] = automaton
            project = Projection([self._bits[a] for a in atoms])
            if isinstance(automaton, Automaton):
                self._readers.append(Reader(automaton, project))
            else:
                self._watched[number] = RecordedAutomaton(automaton)
                self._readers.append(Reader(self._watched[number], project))
            self._atoms.append(tuple(atoms))
            self._about.append(about)
        return number

    def reader(self, number: int) -> Reader:
        return self._readers[number]

    def bad(self, number: int) -> int | None:
        """The state after a bad prefix, as far as one was met."""
        return self._monitors[number].bad

    def widen(self, letters: Iterable[int]) -> None:
        """Ask all monitors for what they do with `letters` in every state, so that what they are can be seen; of large
        ones, of MOST_ROWS moves."""
        for number, monitor in self._monitors.items():
            reader = self._readers[number]
            kinds = sorted({reader.project(letter) for letter in letters})
            state = 0
            try:
                while state < monitor.states and (state + 1) * len(kinds) <= MOST_ROWS:
                    for kind in kinds:
                        self._watched[number](state, kind)
                    state += 1
            except (AutomatonTooLarge, LimitReached):
                continue  # what is asked for in proofs is there

    def document(self) -> list[Json]:
        """All automata as they are known by now: edges are [positive, negative, target or null, acceptance]."""
        return [self._written(number) for number in range(len(self._readers))]

    def _written(self, number: int) -> Json:
        automaton, monitor = self._readers[number].automaton, self._monitors.get(number)
        atoms: list[Json] = [self._bits[a] for a in self._atoms[number]]
        edges: list[Json] = []
        if isinstance(automaton, Automaton):
            edges += [[[e.positive, e.negative, e.target, e.acceptance] for e in row] for row in automaton.edges]
        else:
            edges += _edges(self._watched[number], monitor)
        bad: list[Json] = [] if monitor is None or monitor.bad is None else [monitor.bad]
        return {
            "about": self._about[number],
            "atoms": atoms,
            "sets": automaton.acceptance_sets,
            "complete": not isinstance(automaton, Automaton),
            "bad": bad,
            "edges": edges,
        }


def _edges(automaton: RecordedAutomaton, monitor: MonitorAutomaton | None) -> list[Json]:
    """The rows asked for; a letter without moves has an edge without a target."""
    targets = [t for row in automaton.rows.values() for _, t in row]
    rows: list[list[Json]] = [[] for _ in range(max([0, *targets, *(q for q, _ in automaton.rows)]) + 1)]
    if automaton.is_empty:
        return []
    for (state, letter), moves in sorted(automaton.rows.items()):
        rest = automaton.relevant & ~letter
        rows[state] += [[letter, rest, target, acceptance] for acceptance, target in moves] or [[letter, rest, None, 0]]
    if monitor is not None and monitor.bad is not None:
        rows[monitor.bad] = [[0, 0, monitor.bad, 1]]
    return list(rows)
