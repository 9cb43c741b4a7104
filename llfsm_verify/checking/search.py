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
Node = tuple[int, States]
ATTEMPTS = 64
"""Bad prefixes from which a continuation is looked for before the general search decides."""


class Product:
    """A graph with automata that read its letters side by side (one for their conjunction could be far larger).

    Accepted are the runs that every automaton accepts and whose letters show each of the fair bits infinitely often.
    """

    def __init__(self, graph: Graph, readers: Sequence[Reader], fair_bits: Sequence[int], tick: Tick) -> None:
        self._graph = graph
        self._readers = readers
        self._fair_bits = fair_bits
        self._tick = tick
        self._moves = [Moves(r.automaton) for r in readers]
        self._shifts = [0]
        for r in readers:
            self._shifts.append(self._shifts[-1] + r.automaton.acceptance_sets)
        self._known: dict[Node, tuple[tuple[int, States], ...]] = {}

    def step(self, states: States, letter: int) -> tuple[tuple[int, States], ...]:
        """What the automata can do together with a letter: acceptance and states."""
        found = self._known.get((letter, states))
        if found is None:
            each = [
                [(acceptance << shift, target) for acceptance, target in move(state, r.project(letter))]
                for r, move, shift, state in zip(self._readers, self._moves, self._shifts, states, strict=False)
            ]
            mark = sum(1 << (self._shifts[-1] + i) for i, bit in enumerate(self._fair_bits) if letter >> bit & 1)
            found = tuple(
                (reduce(or_, (a for a, _ in joint), mark), tuple(t for _, t in joint)) for joint in product(*each)
            )
            self._known[letter, states] = found
        return found

    def initial(self, first_letters: Sequence[int]) -> list[Node]:
        """The nodes after the first letter of each root."""
        if any(r.automaton.is_empty for r in self._readers):
            return []
        begin = (0,) * len(self._readers)
        roots = range(self._graph.roots)
        return [(root, states) for root in roots for _, states in self.step(begin, first_letters[root])]

    def successors(self, node: Node) -> Iterator[tuple[int, int, Node]]:
        for target, letter in self._graph.edges(node[0]):
            self._tick()
            for acceptance, states in self.step(node[1], letter):
                yield letter, acceptance, (target, states)

    def lasso(self, starts: Sequence[Node]) -> Walk | None:
        """An accepted run from one of `starts`; None: there is none."""
        sets = self._shifts[-1] + len(self._fair_bits)
        found = find_accepting_lasso(starts, self.successors, sets, self._tick)
        if found is None:
            return None
        steps = [*found.stem, *found.loop]
        nodes = (found.start[0], *(node[0] for _, node in steps))
        return Walk(nodes, tuple(letter for letter, _ in steps), len(found.stem))


def accepting_lasso(
    graph: Graph, first_letters: Sequence[int], readers: Sequence[Reader], fair_bits: Sequence[int], tick: Tick
) -> Walk | None:
    """A run of the graph, as a stem and a loop, that `Product` accepts; None: there is none."""
    both = Product(graph, readers, fair_bits, tick)
    return both.lasso(both.initial(first_letters))


def continued_bad_prefix(
    first_letters: Sequence[int], monitor: BadPrefix, project: Projection, assumed: Product, tick: Tick
) -> Walk | None:
    """A shortest bad prefix that goes on as a run which `assumed` accepts, with that continuation.

    None says little: after `ATTEMPTS` bad prefixes without a continuation the search gives up.
    """
    start = monitor.initial()
    origins: dict[tuple[Node, int | None], tuple[tuple[Node, int | None], int] | None] = {}
    queue: list[tuple[Node, int | None]] = []
    attempts = 0

    def visit(node: Node, state: int | None, origin: tuple[tuple[Node, int | None], int] | None) -> Walk | None:
        nonlocal attempts
        here = (node, state)
        if here in origins:
            return None
        origins[here] = origin
        if state is not None:
            queue.append(here)
            return None
        attempts += 1
        rest = assumed.lasso([node])
        if rest is None or rest.loop is None:
            return None
        nodes, letters, back = [], [], origin
        while back is not None:
            (before, _), letter = back
            nodes.append(before[0])
            letters.append(letter)
            back = origins[back[0]]
        path = (*reversed(nodes), *rest.nodes)
        return Walk(path, (*reversed(letters), *rest.letters), len(letters) + rest.loop)

    for node in assumed.initial(first_letters):
        state = None if start is None else monitor.step(start, project(first_letters[node[0]]))
        found = visit(node, state, None)
        if found is not None:
            return found
    for here in queue:
        node, state = here
        assert state is not None
        for letter, _, target in assumed.successors(node):
            found = visit(target, monitor.step(state, project(letter)), (here, letter))
            if found is not None:
                return found
            if attempts >= ATTEMPTS:
                return None
        tick()
    return None
