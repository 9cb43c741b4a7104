"""A short stem and loop through accepting components: the shortest, unless that would take too long."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

from llfsm_verify.engines.explicit.cores import JointStep
from llfsm_verify.engines.explicit.walk import Walk, walk
from llfsm_verify.kripke.emptiness import Components
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.paths import Breadth, PathStep, SearchTarget
from llfsm_verify.kripke.product import EdgeClasses, ProductNode, Rows, Sizes
from llfsm_verify.kripke.reading import Move

EXTRA_WORK = 1 << 20
"""Edges that may be taken to make a lasso shorter; as many as the search for components took, if that was more."""
MAX_LOOPS = 500
"""Product nodes from which a loop is looked for."""
MOST_VISITS = 10_000
"""States of `Visits` up to which a loop may show the acceptance sets in any order; it is then the shortest."""
FIRST_SHARE = 4
"""The first loop may take so many times that work, before the order of the acceptance sets is fixed."""


class TooManyVisits(Exception):
    """A loop that may show the acceptance sets in any order needs more than MOST_VISITS states."""


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
            if self._any_order and number >= MOST_VISITS:
                raise TooManyVisits
            self.bases.append(base)
            self._seen.append(seen)
        return number


@dataclass(frozen=True, slots=True)
class _Found:
    """A lasso: the number of the product node where the loop begins, the loop, and the letters of both."""

    entry: int
    loop: tuple[PathStep, ...]
    length: int


@dataclass(frozen=True, slots=True)
class Space:
    """Where lassos are looked for: a graph with an automaton, and the search for accepting components."""

    graph: Graph
    classes: EdgeClasses
    reach: Rows
    """The automaton's moves, by which product nodes are reached."""
    components: Components
    inside: JointStep
    """Its moves inside the components of its own that can be accepting; they have other numbers for the states."""
    numbers: Sequence[int] | None
    """Such a number for each state of `reach`, or NO_STATE; None: they are the same."""
    sets: int
    sizes: Sizes

    def number(self, state: int) -> int:
        return state if self.numbers is None else self.numbers[state]


def short_lasso(found: Space, starts: Sequence[ProductNode]) -> Walk:
    """A walk from one of `starts` into an accepting component, and a loop through all acceptance sets.

    Loops are looked for from the accepting product nodes in the order of their distance, until a farther one cannot
    give a shorter lasso. The result is a shortest lasso, unless EXTRA_WORK, MOST_VISITS or MAX_LOOPS ends the search
    for a shorter one, or for all accepting components.
    """
    components = found.components
    left = max(EXTRA_WORK, components.work)
    components.collect(left)
    best: _Found | None = None
    marks = components, found.numbers
    with (
        Breadth(found.graph, found.reach, starts, goal=SearchTarget.ACCEPTING, marks=marks, sizes=found.sizes) as stems,
        _Loops(found) as loops,
    ):
        for _ in range(MAX_LOOPS):
            taken = stems.work
            entry = stems.next(None if best is None else left)
            if best is not None:
                left -= stems.work - taken
            if entry is None or (best is not None and stems.distance + 1 >= best.length):
                break
            node, state = stems.node(entry)
            inner = node, found.number(state)
            if best is None:
                loop, length = loops.any(inner, FIRST_SHARE * left)
                best = _Found(entry, tuple(loop), stems.distance + length)
                continue
            taken = loops.work
            shorter = loops.shortest(inner, best.length - stems.distance - 1, left)
            left -= loops.work - taken
            if shorter is not None:
                best = _Found(entry, tuple(shorter[0]), stems.distance + shorter[1])
            if left <= 0:
                break
        assert best is not None, "the component that was found cannot be reached again"
        start, stem = stems.path(best.entry)
    return walk(start, (*stem, *best.loop), len(stem))


class _Loops:
    """Finds loops through all acceptance sets from given product nodes."""

    def __init__(self, found: Space) -> None:
        self._found = found
        self._visits = Visits(found.inside, found.sets, any_order=True)
        self._rows = Rows(found.classes, self._visits.step)
        self._search: Breadth | None = None
        self._past_work = 0

    @property
    def work(self) -> int:
        """Edges taken so far."""
        return self._past_work + (0 if self._search is None else self._search.work)

    def any(self, node: ProductNode, most: int) -> tuple[list[PathStep], int]:
        """A loop from a node of an accepting component, and its letters: a shortest one, if that takes at most `most`
        edges."""
        loop = self.shortest(node, None, most)
        if loop is None:
            self._keep_order()
            loop = self.shortest(node, None, None)
        assert loop is not None, "an accepting component without a loop through all acceptance sets"
        return loop

    def shortest(self, node: ProductNode, limit: int | None, most: int | None) -> tuple[list[PathStep], int] | None:
        """A shortest loop of at most `limit` letters, and its letters; None: there is none, or `most` edges have been
        taken."""
        try:
            return self._from(node, limit, most)
        except TooManyVisits:
            self._keep_order()
            return self._from(node, limit, most)

    def _keep_order(self) -> None:
        """From now on a loop has to show the acceptance sets in their order."""
        self._past_work = self.work
        self.close()
        self._visits = Visits(self._found.inside, self._found.sets, any_order=False)
        self._rows = Rows(self._found.classes, self._visits.step)

    def _from(self, node: ProductNode, limit: int | None, most: int | None) -> tuple[list[PathStep], int] | None:
        here, base = node
        starts, goal = [(here, self._visits.first(base))], (here, self._visits.all(base))
        search, f = self._search, self._found
        if search is None:
            marks = f.components, self._visits.bases
            search = self._search = Breadth(
                f.graph, self._rows, starts, goal=goal, marks=marks, within=True, limit=limit, sizes=f.sizes
            )
        else:
            search.restart(starts, goal, limit)
        number = search.next(most)
        return None if number is None else (search.path(number)[1], search.distance)

    def close(self) -> None:
        if self._search is not None:
            self._search.close()
            self._search = None
        self._rows.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
