"""Properties against an explored graph: the shortest bad prefix, and accepting lassos of the product."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import or_

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.emptiness import find_accepting_lasso
from llfsm_verify.automata.moves import Moves
from llfsm_verify.automata.safety import BadPrefix
from llfsm_verify.kripke.graph import Graph

Tick = Callable[[], None]


@dataclass(frozen=True, slots=True)
class Walk:
    """A walk through a graph: configurations, and the letter after each of the steps between them.

    ``len(letters) == len(nodes) - 1``. With `loop` the last configuration equals ``nodes[loop]`` and the walk goes on
    from there for ever.
    """

    nodes: tuple[int, ...]
    letters: tuple[int, ...]
    loop: int | None = None


class Projection:
    """Letters of the graph as letters of one property: its atoms are some of the graph's bits, in another order."""

    def __init__(self, bits: Sequence[int]) -> None:
        self._bits = tuple(bits)
        self._cache: dict[int, int] = {}

    def __call__(self, letter: int) -> int:
        found = self._cache.get(letter)
        if found is None:
            found = sum(1 << i for i, b in enumerate(self._bits) if letter >> b & 1)
            self._cache[letter] = found
        return found


def shortest_bad_prefix(
    graph: Graph, first_letters: Sequence[int], monitor: BadPrefix, project: Projection, tick: Tick
) -> Walk | None:
    """A shortest walk whose letters are a bad prefix, by breadth-first search of graph × monitor.

    `first_letters` are the letters of the graph's roots. Source: Kupferman and Vardi, Model Checking of Safety
    Properties, FMSD 2001 (bad prefixes by subset construction).
    """
    start = monitor.initial()
    if start is None:
        return Walk((0,), ()) if graph.roots else None
    steps: dict[tuple[int, int], int | None] = {}

    def step(state: int, letter: int) -> int | None:
        """The next monitor state; None when the prefix is bad."""
        key = (state, letter)
        if key not in steps:
            steps[key] = monitor.step(state, project(letter))
        return steps[key]

    seen: dict[tuple[int, int], int] = {}
    nodes: array[int] = array("q")
    monitors: array[int] = array("q")
    parents: array[int] = array("q")
    letters: list[int] = []

    def walk(position: int, last: int | None, letter: int) -> Walk:
        backwards, shown = ([] if last is None else [last]), ([] if last is None else [letter])
        while position >= 0:
            backwards.append(nodes[position])
            if parents[position] >= 0:
                shown.append(letters[position])
            position = parents[position]
        return Walk(tuple(reversed(backwards)), tuple(reversed(shown)))

    def push(node: int, state: int, parent: int, letter: int) -> None:
        if (node, state) not in seen:
            seen[node, state] = len(nodes)
            nodes.append(node)
            monitors.append(state)
            parents.append(parent)
            letters.append(letter)

    for root in range(graph.roots):
        state = step(start, first_letters[root])
        if state is None:
            return Walk((root,), ())
        push(root, state, -1, 0)
    position = 0
    while position < len(nodes):
        state = monitors[position]
        for target, letter in graph.edges(nodes[position]):
            tick()
            following = step(state, letter)
            if following is None:
                return walk(position, target, letter)
            push(target, following, position, letter)
        position += 1
    return None


@dataclass(frozen=True, slots=True)
class Reader:
    """An automaton that reads the letters of a graph, seen through the projection to its atoms."""

    automaton: Automaton
    project: Projection


States = tuple[int, ...]
"""One state of each automaton."""


def accepting_lasso(
    graph: Graph, first_letters: Sequence[int], readers: Sequence[Reader], fair_bits: Sequence[int], tick: Tick
) -> Walk | None:
    """A run of the graph, as a stem and a loop, that every automaton accepts and whose letters show each of the fair
    bits infinitely often; None: there is none.

    The automata run side by side: one automaton for their conjunction could be exponentially larger.
    """
    if any(r.automaton.is_empty for r in readers):
        return None
    moves = [Moves(r.automaton) for r in readers]
    shifts = [0]
    for r in readers:
        shifts.append(shifts[-1] + r.automaton.acceptance_sets)
    known: dict[tuple[States, int], tuple[tuple[int, States], ...]] = {}

    def step(states: States, letter: int) -> tuple[tuple[int, States], ...]:
        found = known.get((states, letter))
        if found is None:
            each = [
                [(acceptance << shift, target) for acceptance, target in move(state, r.project(letter))]
                for r, move, shift, state in zip(readers, moves, shifts, states, strict=False)
            ]
            mark = sum(1 << (shifts[-1] + i) for i, bit in enumerate(fair_bits) if letter >> bit & 1)
            found = tuple(
                (reduce(or_, (a for a, _ in together), mark), tuple(t for _, t in together))
                for together in product(*each)
            )
            known[states, letter] = found
        return found

    def successors(node: tuple[int, States]) -> Iterator[tuple[int, int, tuple[int, States]]]:
        for target, letter in graph.edges(node[0]):
            tick()
            for acceptance, states in step(node[1], letter):
                yield letter, acceptance, (target, states)

    begin = (0,) * len(readers)
    initial = [(root, states) for root in range(graph.roots) for _, states in step(begin, first_letters[root])]
    lasso = find_accepting_lasso(initial, successors, shifts[-1] + len(fair_bits), tick)
    if lasso is None:
        return None
    steps = [*lasso.stem, *lasso.loop]
    nodes = (lasso.start[0], *(node[0] for _, node in steps))
    return Walk(nodes, tuple(letter for letter, _ in steps), len(lasso.stem))
