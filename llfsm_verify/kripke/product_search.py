"""Properties against an explored graph: short accepting lassos of the product with automata."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import or_

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.moves import Lazy, moves_of
from llfsm_verify.files import Closing
from llfsm_verify.kripke.graph import EPSILON, Graph
from llfsm_verify.kripke.lassos import Cores, Space, Walk, short_lasso, walk
from llfsm_verify.kripke.paths import Breadth, Components, PathStep, SearchTarget
from llfsm_verify.kripke.product import (
    MAX_SETS,
    SIZES,
    EdgeClasses,
    LabelClasses,
    Move,
    ProductNode,
    Reading,
    Rows,
    Sizes,
)
from llfsm_verify.limits import tick

__all__ = ["Product", "Projection", "Reader", "Walk", "accepting_lasso"]


class Projection:
    """Letters of the graph as letters of one property: its atoms are some of the graph's bits, in another order."""

    def __init__(self, bits: Sequence[int]) -> None:
        self._bits = tuple(bits)
        self._cache: dict[int, int] = {}

    def bits(self, atoms: int = -1) -> int:
        """The mask of the graph's bits that show these atoms, a mask."""
        return reduce(or_, (1 << bit for i, bit in enumerate(self._bits) if atoms >> i & 1), 0)

    def __call__(self, letter: int) -> int:
        found = self._cache.get(letter)
        if found is None:
            found = sum(1 << i for i, b in enumerate(self._bits) if letter >> b & 1)
            self._cache[letter] = found
        return found


@dataclass(frozen=True, slots=True)
class Reader:
    """An automaton that reads the letters of a graph, seen through the projection to its atoms."""

    automaton: Automaton | Lazy
    project: Projection


States = tuple[int, ...]
"""One state of each automaton."""
Node = tuple[int, States]


class Product:
    """A graph with automata that read its letters side by side (one for their conjunction could be far larger).

    Accepted are the runs that every automaton accepts and whose letters show each of the fair bits infinitely often.
    An edge that shows no letter leaves the automata where they are.
    """

    def __init__(self, graph: Graph, readers: Sequence[Reader], fair_bits: Sequence[int], sizes: Sizes = SIZES) -> None:
        self.graph = graph
        self.sizes = sizes
        self._readers = tuple(readers)
        self.fair_bits = tuple(fair_bits)
        self.parts = len(self._readers)
        self.is_empty = any(r.automaton.is_empty for r in readers)
        """Some automaton accepts nothing."""
        self._moves = [moves_of(r.automaton) for r in readers]
        shown = (r.project.bits(m.relevant) for r, m in zip(readers, self._moves, strict=True))
        self.bits = reduce(or_, shown, reduce(or_, (1 << bit for bit in fair_bits), 0))
        """The mask of what of a letter matters here."""
        self._shifts = [0]
        for r in readers:
            self._shifts.append(self._shifts[-1] + r.automaton.acceptance_sets)
        self.sets = self._shifts[-1] + len(self.fair_bits)
        """Acceptance sets: those of the automata, one after the other, then one for each fair bit."""
        self._states: list[States] = []
        self._numbers: dict[States, int] = {}
        self._known: dict[tuple[int, int], tuple[Move, ...]] = {}

    def step(self, state: int, letter: int) -> tuple[Move, ...]:
        """What the automata can do together with a letter: numbers of states, and acceptance."""
        kind = letter & self.bits
        found = self._known.get((state, kind))
        if found is None:
            joint = self._joint(self._states[state], letter)
            found = tuple((self.number(states), acceptance) for acceptance, states in joint)
            self._known[state, kind] = found
        return found

    def number(self, states: States) -> int:
        """The number of a joint state."""
        number = self._numbers.setdefault(states, len(self._states))
        if number == len(self._states):
            self._states.append(states)
        return number

    def states(self, number: int) -> States:
        """The joint state of a number."""
        return self._states[number]

    def _joint(self, states: States, letter: int) -> Iterator[tuple[int, States]]:
        each = [
            [(acceptance << shift, target) for acceptance, target in move(state, r.project(letter))]
            for r, move, shift, state in zip(self._readers, self._moves, self._shifts, states, strict=False)
        ]
        mark = sum(1 << (self._shifts[-1] + i) for i, bit in enumerate(self.fair_bits) if letter >> bit & 1)
        for joint in product(*each):
            yield reduce(or_, (a for a, _ in joint), mark), tuple(t for _, t in joint)

    def initial(self, first_letters: Sequence[int]) -> list[Node]:
        """The nodes after the first letter of each root."""
        if self.is_empty:
            return []
        begin = (0,) * self.parts
        known: dict[int, list[States]] = {}
        nodes: list[Node] = []
        for root in range(self.graph.roots):
            letter = first_letters[root]
            if letter not in known:
                known[letter] = [states for _, states in self._joint(begin, letter)]
            nodes += [(root, states) for states in known[letter]]
        return nodes

    def lasso(self, starts: Sequence[Node]) -> Walk | None:
        """An accepted run from one of `starts`, a short one; None: there is none."""
        with self.search(starts) as search:
            return search.lasso(starts)

    def accepts(self, starts: Sequence[Node]) -> bool:
        """Whether there is an accepted run from one of `starts`; faster than `lasso` where there is one."""
        with self.search(starts) as search:
            return search.accepts(starts)

    def search(self, first: Sequence[Node]) -> LassoSearch:
        """A search for lassos from several starts, one after the other, which can be reached from `first`."""
        return LassoSearch(self, first)


class LassoSearch(Closing):
    """Looks for accepted runs from several starts; what has been searched in vain is not searched again.

    First everything is reached, breadth first, then components are looked for with the states of the automata that can
    lie on an accepting loop (`kripke.lassos.Cores`).
    """

    def __init__(self, over: Product, first: Iterable[Node]) -> None:
        """All starts are among `first` and what can be reached from there."""
        self._product = over
        self._open = ExitStack()
        self._reached: Breadth | None = None
        self._fits = over.sets <= MAX_SETS
        if self._fits:
            with ExitStack() as stack:
                graph, sizes = over.graph, over.sizes
                classes = EdgeClasses(graph, over.bits)
                cores = self._cores = Cores(over.step, classes.letters, over.sets, sizes.rows)
                cores.add((over.number(states) for _, states in first))
                reach = self._reach = stack.enter_context(Rows(classes, cores.toward))
                inside = stack.enter_context(Rows(classes, cores.inside))
                components = stack.enter_context(Components(graph, inside, over.sets, sizes))
                numbers = None if cores.unknown else cores.numbers
                self._space = Space(graph, classes, reach, components, cores.inside, numbers, over.sets, sizes)
                self._open = stack.pop_all()

    def lasso(self, starts: Sequence[Node]) -> Walk | None:
        """An accepted run from one of `starts`; None: there is none. After the first one found, the search is over."""
        if not self._fits:
            return self._plain(starts)
        useful = self._useful(starts)
        return short_lasso(self._space, useful) if self._found(useful) else None

    def accepts(self, starts: Sequence[Node]) -> bool:
        """Whether there is an accepted run from one of `starts`; without the time for a short one."""
        if not self._fits:
            return self._plain(starts) is not None
        return self._found(self._useful(starts))

    def _useful(self, starts: Sequence[Node]) -> list[ProductNode]:
        numbered = ((node, self._product.number(states)) for node, states in dict.fromkeys(starts))
        return [(node, state) for node, state in numbered if self._cores.is_useful(state)]

    def _found(self, starts: Sequence[ProductNode]) -> bool:
        components = self._space.components
        if not starts:
            return False
        if self._cores.single:
            return components.search([(node, self._space.number(state)) for node, state in starts])
        return components.search_found(self._reach_all(starts), self._cores.numbers)

    def _reach_all(self, starts: Sequence[ProductNode]) -> Breadth:
        over = self._product
        if self._reached is None:
            self._reached = self._open.enter_context(
                Breadth(over.graph, self._reach, starts, goal=SearchTarget.NOTHING, sizes=over.sizes)
            )
        else:
            self._reached.start(starts)
        self._reached.next()
        return self._reached

    def _plain(self, starts: Sequence[Node]) -> Walk | None:
        """By Python, for more acceptance sets than fit a word."""
        over = self._product
        classes = LabelClasses(over.graph, over.bits)
        moves = Reading(classes, over.step)

        def successors(node: ProductNode) -> Iterator[tuple[int, int, ProductNode]]:
            for target, label in over.graph.arcs(node[0]):
                tick()
                if label == EPSILON:
                    yield label, 0, (target, node[1])
                    continue
                for state, acceptance in moves(node[1], classes.of_label[label]):
                    yield label, acceptance, (target, state)

        numbered = [(node, over.number(states)) for node, states in starts]
        found = find_accepting_lasso(numbered, successors, over.sets)
        if found is None:
            return None
        return walk(
            found.start,
            [PathStep(over.graph.shown(label), node) for label, node in (*found.stem, *found.loop)],
            len(found.stem),
        )

    def close(self) -> None:
        self._open.close()


def accepting_lasso(
    graph: Graph,
    first_letters: Sequence[int],
    readers: Sequence[Reader],
    fair_bits: Sequence[int],
    sizes: Sizes = SIZES,
) -> Walk | None:
    """A run of the graph, as a short stem and loop, that `Product` accepts; None: there is none."""
    both = Product(graph, readers, fair_bits, sizes)
    return both.lasso(both.initial(first_letters))
