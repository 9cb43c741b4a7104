"""Automata as certificates write them: those made on demand as far as they were asked."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.product_search import Projection, Reader
from llfsm_verify.limits import LimitReached

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
