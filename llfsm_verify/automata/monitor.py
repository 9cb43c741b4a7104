"""Monitors: what a finite word already says about a property, as a minimal deterministic automaton."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.automata.labels import MAX_TABLE, Alphabet, L, TruthTables, cubes
from llfsm_verify.automata.reduction import closure
from llfsm_verify.automata.simulation import simulating
from llfsm_verify.automata.subsets import Step, equivalent, maximal, regions_of
from llfsm_verify.automata.symbolic import Symbolic, Tick, from_automaton
from llfsm_verify.automata.translate import translate
from llfsm_verify.logic.formula import Formula, atoms

MAX_STATES = 10_000
MAX_EDGES = 200_000


class Verdict(Enum):
    """What holds for all continuations of the word read."""

    TRUE = "true"
    """All of them satisfy the property."""
    FALSE = "false"
    """None of them satisfies it."""
    NOT_YET = "not yet"
    """Some do, some do not."""


class Monitorability(Enum):
    """Whether reading on can still give a verdict."""

    ALWAYS = "always"
    """After every word some continuation gives a verdict."""
    SOMETIMES = "sometimes"
    """At first, but there are words after which no continuation does."""
    NEVER = "never"
    """No word gives a verdict: the property cannot be monitored."""


@dataclass(frozen=True, slots=True)
class MonitorEdge:
    """A step for all letters in which the atoms of `positive` hold and those of `negative` do not (bit i: atom i)."""

    positive: int
    negative: int
    target: int


@dataclass(frozen=True, slots=True)
class Monitor:
    """A minimal deterministic and complete automaton; state 0 is initial.

    `verdicts[q]` is the verdict in state q; a state with one is never left. `edges[q]`: just one allows a letter.
    `hopeless[q]`: no continuation gives a verdict any more.
    """

    atoms: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    edges: tuple[tuple[MonitorEdge, ...], ...]
    hopeless: tuple[bool, ...]

    @property
    def monitorability(self) -> Monitorability:
        """Whether a verdict can be reached from every state, or from the initial one at least."""
        if self.hopeless[0]:
            return Monitorability.NEVER
        return Monitorability.SOMETIMES if any(self.hopeless) else Monitorability.ALWAYS

    def step(self, state: int, letter: int) -> int:
        """The state after `letter`, the mask of the atoms that hold."""
        for edge in self.edges[state]:
            if edge.positive & ~letter == 0 and edge.negative & letter == 0:
                return edge.target
        raise AssertionError("a monitor has a step for every letter")

    def letter(self, true_atoms: Collection[str]) -> int:
        """The mask of a letter given by the keys of its true atoms; others than `atoms` do not matter."""
        return sum(1 << i for i, key in enumerate(self.atoms) if key in true_atoms)

    def verdict(self, word: Sequence[Collection[str]]) -> Verdict:
        """The verdict after `word`, whose letters are given by their true atoms."""
        state = 0
        for letter in word:
            state = self.step(state, self.letter(letter))
        return self.verdicts[state]


def monitor(
    formula: Formula,
    atom_order: Sequence[str] | None = None,
    *,
    max_states: int = MAX_STATES,
    max_edges: int = MAX_EDGES,
    tick: Tick | None = None,
) -> Monitor:
    """The monitor of `formula` over `atom_order` (its own atoms by default).

    Source: Bauer, Leucker and Schallhart, Runtime verification for LTL and TLTL, ACM TOSEM 20 (2011). ValueError as for
    `translate`; AutomatonTooLarge: it has more states or edges than allowed (before it is minimised).
    """
    keys = tuple(atoms(formula) if atom_order is None else atom_order)
    satisfying, violating = (
        translate(formula, keys, negate=negate, closed=True, tick=tick) for negate in (False, True)
    )
    return monitor_of(satisfying, violating, max_states=max_states, max_edges=max_edges, tick=tick)


def monitor_of(
    satisfying: Automaton,
    violating: Automaton,
    *,
    max_states: int = MAX_STATES,
    max_edges: int = MAX_EDGES,
    tick: Tick | None = None,
) -> Monitor:
    """The monitor of a property given by an automaton of it and one of its complement, over the same atoms."""
    if satisfying.atoms != violating.atoms:
        raise ValueError("the automata have different atoms")
    keys = satisfying.atoms
    used = [i for i in range(len(keys)) if any(_mentions(a, 1 << i) for a in (satisfying, violating))]

    def over(alphabet: Alphabet[L]) -> Monitor:
        good, bad = (closure(from_automaton(_narrowed(a, used), alphabet), tick) for a in (satisfying, violating))
        explored = _explored(good, bad, max_states, max_edges, tick)
        return _minimal(alphabet, explored, keys, used, max_edges)

    return over(TruthTables(len(used))) if len(used) <= MAX_TABLE else over(Diagrams(len(used)))


_Explored = tuple[list[Verdict], list[list[Step[L]]]]


def _explored(
    satisfying: Symbolic[L], violating: Symbolic[L], max_states: int, max_edges: int, tick: Tick | None
) -> _Explored[L]:
    """Pairs of subsets: the states that the two automata can be in. An empty one is a verdict, and ends the search."""
    shift = len(satisfying.rows)
    moved = tuple(tuple((label, a, target + shift) for label, a, target in row) for row in violating.rows)
    union = Symbolic(satisfying.alphabet, satisfying.rows + moved, 0)
    above = simulating(satisfying, tick)
    above += (mask << shift for mask in simulating(violating, tick))
    low = (1 << shift) - 1
    start = (1 if satisfying.rows else 0) | (1 << shift if violating.rows else 0)

    def canonical(members: int) -> int:
        if members & low == 0:
            return 0
        return maximal(members, above) if members & ~low else low

    numbers = {canonical(start): 0}
    queue = [canonical(start)]
    verdicts: list[Verdict] = []
    rows: list[list[Step[L]]] = []
    made = 0
    for members in queue:
        if tick is not None:
            tick()
        if members in (0, low):
            verdicts.append(Verdict.TRUE if members and not members & ~low else Verdict.FALSE)
            rows.append([(union.alphabet.true, numbers[members])])
            continue
        verdicts.append(Verdict.NOT_YET)
        row: list[Step[L]] = []
        for label, targets in regions_of(union, members, made, max_edges):
            name = canonical(targets)
            number = numbers.setdefault(name, len(queue))
            if number == len(queue):
                queue.append(name)
                if len(queue) > max_states:
                    raise AutomatonTooLarge("states", max_states)
            row.append((label, number))
        made += len(row)
        rows.append(row)
    return verdicts, rows


def _minimal(
    alphabet: Alphabet[L], explored: _Explored[L], keys: tuple[str, ...], used: Sequence[int], max_edges: int
) -> Monitor:
    verdicts, rows = explored
    order = list(Verdict)
    blocks = equivalent(rows, [order.index(verdict) for verdict in verdicts])
    first: dict[int, int] = {}
    for state, block in enumerate(blocks):
        first.setdefault(block, state)
    edges: list[tuple[MonitorEdge, ...]] = []
    made = 0
    for state in first.values():
        labels: dict[int, L] = {}
        for label, target in rows[state]:
            known = labels.get(blocks[target])
            labels[blocks[target]] = label if known is None else known | label
        row = tuple(
            MonitorEdge(_widened(positive, used), _widened(negative, used), target)
            for target, label in labels.items()
            for positive, negative in cubes(alphabet, label)
        )
        made += len(row)
        if made > max_edges:
            raise AutomatonTooLarge("transitions", max_edges)
        edges.append(row)
    found = tuple(verdicts[state] for state in first.values())
    return Monitor(keys, found, tuple(edges), _hopeless(found, edges))


def _hopeless(verdicts: Sequence[Verdict], edges: Sequence[Sequence[MonitorEdge]]) -> tuple[bool, ...]:
    """The states from which no verdict can be reached: backwards from the verdicts."""
    sources: list[list[int]] = [[] for _ in edges]
    for state, row in enumerate(edges):
        for edge in row:
            sources[edge.target].append(state)
    hope = [verdict is not Verdict.NOT_YET for verdict in verdicts]
    queue = [state for state, has in enumerate(hope) if has]
    for state in queue:
        for source in sources[state]:
            if not hope[source]:
                hope[source] = True
                queue.append(source)
    return tuple(not has for has in hope)


def _mentions(automaton: Automaton, bit: int) -> bool:
    return any((edge.positive | edge.negative) & bit for row in automaton.edges for edge in row)


def _narrowed(automaton: Automaton, used: Sequence[int]) -> Automaton:
    """Over the atoms `used` only, which are all that its edges mention."""

    def narrow(mask: int) -> int:
        return sum(1 << i for i, place in enumerate(used) if mask >> place & 1)

    rows = tuple(
        tuple(replace(e, positive=narrow(e.positive), negative=narrow(e.negative)) for e in row)
        for row in automaton.edges
    )
    return Automaton(tuple(automaton.atoms[place] for place in used), rows, automaton.acceptance_sets)


def _widened(mask: int, used: Sequence[int]) -> int:
    return sum(1 << place for i, place in enumerate(used) if mask >> i & 1)
