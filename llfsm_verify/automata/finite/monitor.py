"""Regular properties read configuration by configuration: the shortest word that violates one is noticed at once.

`RegularMonitor` makes its states as words are read, `allowed_words` all of them: the smallest automaton."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.finite.expressions import (
    MAX_STATES,
    DeterministicAutomaton,
    FiniteAutomaton,
    explore_subsets,
    minimise,
    nondeterministic,
)
from llfsm_verify.limits import tick
from llfsm_verify.logic.expressions import letters, nullable
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.regular import RegularKind, exclusions

MAX_MONITOR_STATES = 100_000

Valuation = int
"""A mask over the letters of the expression: bit i is letter i."""
Barred = Valuation | None
"""A state from which a word can be completed after any valuation (None), or after any but this one."""


class NoWord(Exception):
    """No sequence of letters matches the expression."""


class EmptyWordForbidden(Exception):
    """`forbid` of an expression that the empty word matches."""


class RegularMonitor:
    """Reads a word letter by letter and tells when no continuation of it has the property any more.

    States are small numbers: a set of states of the expression's automaton with the last valuation of its letters (two
    configurations with the same valuation count as one). Same protocol as `safety.BadPrefix`.
    """

    def __init__(
        self, kind: RegularKind, expression: Formula, atom_order: Sequence[str], possible: Formula | None = None
    ) -> None:
        """`atom_order` gives the bits of letters; `possible` is what every configuration satisfies.

        `possible` is by default that a machine is in one state at a time; atoms are free otherwise. NoWord,
        EmptyWordForbidden: the property is void. AutomatonTooLarge: the expression's automaton is.
        """
        self._kind = kind
        self._guards = guards = Guards(atom_order)
        self._world = guards.of(exclusions(atom_order) if possible is None else possible)
        self._letters, self._automaton, self._open = _opened(kind, expression, guards, self._world)
        keys = frozenset(atoms(*letters(expression)))
        self.relevant = sum(1 << i for i, key in enumerate(atom_order) if key in keys)
        self._states: list[tuple[frozenset[int], Valuation | None]] = []
        self._numbers: dict[tuple[frozenset[int], Valuation | None], int] = {}
        self._steps: dict[tuple[int, int], int | None] = {}
        self._valuations: dict[int, Valuation] = {}
        self._number(frozenset((0,)), None)

    def initial(self) -> int | None:
        """The state before the first letter."""
        return 0

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: the word read so far is a bad prefix."""
        key = (state, letter & self.relevant)
        if key not in self._steps:
            self._steps[key] = self._step(*key)
        return self._steps[key]

    def bad_prefix(self) -> tuple[int, ...] | None:
        """A shortest bad prefix, whose letters have each machine in one state. None: no word is one, so every run of
        any arrangement has the property. AutomatonTooLarge; LimitReached."""
        todo: list[tuple[int, tuple[int, ...]]] = [(0, ())]
        seen, guards = {0}, self._guards
        for state, word in todo:
            left = self._world
            while left:  # one letter of each valuation
                tick()
                letter = guards.example(left)
                left = left & ~_shown(guards, self._letters, self._world, letter)[1]
                after = self.step(state, letter)
                if after is None:
                    return (*word, letter)
                if after not in seen:
                    seen.add(after)
                    todo.append((after, (*word, letter)))
        return None

    def _step(self, state: int, letter: int) -> int | None:
        states, last = self._states[state]
        valuation = self._valuation(letter)
        if valuation == last:
            return state
        sources = states | {0} if self._kind == "forbid" else states
        reached = {t for q in sources for guard, t in self._automaton.edges[q] if self._guards.holds(guard, letter)}
        if self._kind != "enforce":
            bad = any(self._automaton.accepting[q] for q in reached)
            return None if bad else self._number(frozenset(reached), valuation)
        left = frozenset(q for q in reached if q in self._open and self._open[q] != valuation)
        return self._number(left, valuation) if left else None

    def _valuation(self, letter: int) -> Valuation:
        found = self._valuations.get(letter)
        if found is None:
            found = sum(1 << i for i, guard in enumerate(self._letters) if self._guards.holds(guard, letter))
            self._valuations[letter] = found
        return found

    def _number(self, states: frozenset[int], last: Valuation | None) -> int:
        key = (states, last)
        number = self._numbers.setdefault(key, len(self._states))
        if number == len(self._states):
            if number >= MAX_MONITOR_STATES:
                raise AutomatonTooLarge("states", MAX_MONITOR_STATES)
            self._states.append(key)
        return number


def _opened(
    kind: RegularKind, expression: Formula, guards: Guards, world: Guard
) -> tuple[list[Guard], FiniteAutomaton, dict[int, Barred]]:
    """The sets of an expression's letters, its automaton, and `open_states`. NoWord, EmptyWordForbidden."""
    alphabet = [guards.of(f) for f in letters(expression)]
    automaton = nondeterministic(expression, guards)
    found = open_states(automaton, alphabet, world)
    if 0 not in found:
        raise NoWord
    if kind != "enforce" and nullable(expression):
        raise EmptyWordForbidden
    return alphabet, automaton, found


def open_states(automaton: FiniteAutomaton, alphabet: Sequence[Guard], world: Guard) -> dict[int, Barred]:
    """The states from which a word of the property can be completed, with the last valuation after which it cannot.

    A word has no two equal neighbours, so a state whose only next valuation is V is of no use right after V. The
    least solution, from the accepting states backwards. `alphabet` are the sets of the letters,
    `world` the configurations there can be.
    """
    guards = automaton.guards
    found: dict[int, Barred] = {}
    before: list[set[int]] = [set() for _ in automaton.edges]
    for q, row in enumerate(automaton.edges):
        for _, target in row:
            before[target].add(q)

    classes: dict[Valuation, Guard] = {}

    def judged(q: int) -> tuple[bool, Barred]:
        """Whether `q` is open, and after which valuation it is not."""
        if automaton.accepting[q]:
            return True, None
        only: Barred = None
        for guard, target in automaton.edges[q]:
            if target not in found:
                continue
            left = guard & world
            barred = found[target]
            if barred is not None:
                left = left & ~classes[barred]
            while left:
                valuation, alike = _shown(guards, alphabet, world, guards.example(left))
                classes[valuation] = alike
                if only is not None and only != valuation:
                    return True, None
                only, left = valuation, left & ~alike
        return only is not None, only

    queue = list(range(len(automaton.edges)))
    while queue:
        q = queue.pop()
        is_open, barred = judged(q)
        if is_open and (q not in found or found[q] != barred):
            found[q] = barred
            queue.extend(before[q])
    return found


def _shown(guards: Guards, alphabet: Sequence[Guard], world: Guard, letter: int) -> tuple[Valuation, Guard]:
    """The valuation that `letter` shows, with all letters that show it."""
    valuation, alike = 0, world
    for i, guard in enumerate(alphabet):
        if guards.holds(guard, letter):
            valuation, alike = valuation | 1 << i, alike & guard
        else:
            alike = alike & ~guard
    return valuation, alike


def allowed_words(
    kind: RegularKind, expression: Formula, guards: Guards, max_states: int = MAX_STATES
) -> DeterministicAutomaton:
    """The automaton of the words that violate nothing: in each state a letter without an edge does.

    It reads configurations whose valuation of the expression's letters differs from the one before; who runs it leaves
    out the others. Letters are told apart only where those of one state do, never all of the expression's. All states
    accept. NoWord, EmptyWordForbidden, AutomatonTooLarge as for `RegularMonitor`.
    """
    world = guards.of(exclusions(guards.atoms))
    alphabet, automaton, classes = _opened(kind, expression, guards, world)
    same = {v: _showing(v, alphabet, world) for v in classes.values() if v is not None}
    _, edges = explore_subsets(
        frozenset((0,)), lambda states: _successors(kind, automaton, states, classes, same, world).items(), max_states
    )
    return minimise(DeterministicAutomaton(guards, edges, (True,) * len(edges)))


def _showing(valuation: int, alphabet: list[Guard], world: Guard) -> Guard:
    """The configurations that show `valuation`."""
    result = world
    for i, guard in enumerate(alphabet):
        result = result & (guard if valuation >> i & 1 else ~guard)
    return result


def _successors(
    kind: RegularKind,
    automaton: FiniteAutomaton,
    states: frozenset[int],
    classes: dict[int, int | None],
    same: dict[int, Guard],
    world: Guard,
) -> dict[Guard, frozenset[int]]:
    """The states after each class of letters that violates nothing."""
    leaving = [edge for q in sorted(states | {0} if kind == "forbid" else states) for edge in automaton.edges[q]]
    found: dict[Guard, frozenset[int]] = {}
    barred = {v for _, t in leaving if (v := classes.get(t)) is not None} if kind == "enforce" else set()
    marks = [*(guard for guard, _ in leaving), *(same[v] for v in sorted(barred))]
    for part, inside in automaton.guards.partition(marks, world).items():
        targets = {t for guard, t in leaving if guard in inside}
        if kind != "enforce":
            if not any(automaton.accepting[t] for t in targets):
                found[part] = frozenset(targets)
            continue
        shown = {valuation for valuation, guard in same.items() if guard in inside}
        left = frozenset(t for t in targets if t in classes and classes[t] not in shown)
        if left:
            found[part] = left
    return found
