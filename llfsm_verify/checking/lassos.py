"""A short stem and loop through accepting components: the shortest, unless that would take too long."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Self

from llfsm_verify.checking.walk import Walk, walk
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product import Breadth, Components, Move, ProductNode, Rows, Sizes, Step

EXTRA_WORK = 1 << 22
"""Edges that may be taken to make a lasso shorter; as many as the search took, if that was more."""
MAX_LOOPS = 500
"""Product nodes from which a loop is looked for."""
EXACT_SETS = 8
"""Acceptance sets up to which a loop may show them in any order; it is then the shortest."""
FIRST_SHARE = 4
"""The first loop may take so many times that work, before the order of the acceptance sets is fixed."""

JointStep = Callable[[int, int], Sequence[Move]]


class Visits:
    """An automaton that also remembers which acceptance sets a loop has shown, in its order, or in any.

    In any order that is one state for each subset of the sets, in their order one for each of their number. Without
    sets, a loop has to show a letter.
    """

    def __init__(self, step: JointStep, sets: int, *, any_order: bool) -> None:
        self._joint_step = step
        self._sets = sets
        self._any_order = any_order
        self._numbers: dict[tuple[int, int], int] = {}
        self._seen: list[int] = []
        self.bases: list[int] = []
        """The automaton's state, by state."""

    def first(self, base: int) -> int:
        """The state that has seen nothing."""
        return self._number(base, 0)

    def all(self, base: int) -> int:
        """The state that has seen all."""
        count = max(1, self._sets)
        return self._number(base, (1 << count) - 1 if self._any_order else count)

    def step(self, state: int, letter: int) -> Iterable[Move]:
        base, seen = self.bases[state], self._seen[state]
        moves = ((target, self._also(seen, acceptance)) for target, acceptance in self._joint_step(base, letter))
        return tuple((self._number(*pair), 0) for pair in dict.fromkeys(moves))

    def _also(self, seen: int, acceptance: int) -> int:
        acceptance = acceptance if self._sets else 1
        if self._any_order:
            return seen | acceptance
        while acceptance >> seen & 1:
            seen += 1
        return seen

    def _number(self, base: int, seen: int) -> int:
        number = self._numbers.setdefault((base, seen), len(self.bases))
        if number == len(self.bases):
            self.bases.append(base)
            self._seen.append(seen)
        return number


@dataclass(frozen=True, slots=True)
class _Found:
    """A lasso: the number of the product node where the loop begins, the loop, and the letters of both."""

    entry: int
    loop: tuple[Step, ...]
    length: int


def short_lasso(
    graph: Graph,
    components: Components,
    rows: Rows,
    step: JointStep,
    sets: int,
    starts: Sequence[ProductNode],
    tick: Callable[[], None],
    sizes: Sizes,
) -> Walk:
    """A walk from one of `starts` into an accepting component that `components` has found, and a loop through all sets.

    Loops are looked for from the accepting product nodes in the order of their distance, until a farther one cannot
    give a shorter lasso. With at most EXACT_SETS sets the result is a shortest lasso, unless EXTRA_WORK or MAX_LOOPS
    ends the search for a shorter one, or for all accepting components.
    """
    left = max(EXTRA_WORK, components.work)
    components.collect(left)
    best: _Found | None = None
    loops = _Loops(graph, components, rows, step, sets, tick, sizes)
    with Breadth(graph, rows, starts, tick, goal=components, sizes=sizes) as stems, loops:
        for _ in range(MAX_LOOPS):
            taken = stems.work
            entry = stems.next(None if best is None else left)
            if best is not None:
                left -= stems.work - taken
            if entry is None or (best is not None and stems.distance + 1 >= best.length):
                break
            taken = loops.work
            if best is None:
                loop, length = loops.any(stems.node(entry), FIRST_SHARE * left)
            else:
                found = loops.shortest(stems.node(entry), best.length - stems.distance - 1, left)
                left -= loops.work - taken
                if found is None:
                    if left <= 0:
                        break
                    continue
                loop, length = found
            best = _Found(entry, tuple(loop), stems.distance + length)
        assert best is not None, "the component that was found cannot be reached again"
        start, stem = stems.path(best.entry)
    return walk(start, (*stem, *best.loop), len(stem))


class _Loops:
    """Finds loops through all acceptance sets from given product nodes."""

    def __init__(
        self,
        graph: Graph,
        components: Components,
        rows: Rows,
        step: JointStep,
        sets: int,
        tick: Callable[[], None],
        sizes: Sizes,
    ) -> None:
        self._graph = graph
        self._components = components
        self._step = step
        self._sets = sets
        self._tick = tick
        self._sizes = sizes
        self._base_rows = rows
        self._visits = Visits(step, sets, any_order=sets <= EXACT_SETS)
        self._rows = rows.of(self._visits.step)
        self.work = 0
        """Edges taken so far."""

    def any(self, node: ProductNode, most: int) -> tuple[list[Step], int]:
        """A loop from a node of an accepting component, and its letters: a shortest one, if that takes at most `most`
        edges."""
        if self._sets <= EXACT_SETS:
            found = self.shortest(node, None, most)
            if found is not None:
                return found
            self._visits = Visits(self._step, self._sets, any_order=False)
            self._rows.close()
            self._rows = self._base_rows.of(self._visits.step)
        found = self.shortest(node, None, None)
        assert found is not None, "an accepting component without a loop through all acceptance sets"
        return found

    def shortest(self, node: ProductNode, limit: int | None, most: int | None) -> tuple[list[Step], int] | None:
        """A shortest loop of at most `limit` letters, and its letters; None: there is none, or `most` edges have been
        taken."""
        here, base = node
        start, goal = (here, self._visits.first(base)), (here, self._visits.all(base))
        within = self._components, self._visits.bases
        with Breadth(
            self._graph, self._rows, [start], self._tick, goal=goal, within=within, limit=limit, sizes=self._sizes
        ) as search:
            try:
                number = search.next(most)
                return None if number is None else (search.path(number)[1], search.distance)
            finally:
                self.work += search.work

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._rows.close()
