"""Accepting lassos of a product, as walks: in which part of it they lie, and how to make them short.

Only with states of the automaton that can lie on an accepting loop (`Cores`) is the product searched for components.
The other states need no more than to be reached, which takes a tenth of the time. In the negation of ``G (a -> F b)``
these are the states before the `a` that is not answered, with which nearly all nodes of the product are.

A stem and loop through accepting components is the shortest one, unless that would take too long.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.omega.components import components
from llfsm_verify.files import Closing
from llfsm_verify.kripke.graph import Graph, Letters
from llfsm_verify.kripke.paths import Breadth, Components, PathStep, SearchTarget
from llfsm_verify.kripke.product import NO_STATE, EdgeClasses, Move, ProductNode, Rows, Sizes
from llfsm_verify.limits import tick


@dataclass(frozen=True, slots=True)
class Walk:
    """Nodes of the graph, and what each of the steps between them shows: a letter, those of a chain, None for nothing.

    ``len(letters) == len(nodes) - 1``. The last step may be the first part of a chain. With `loop` the last node equals
    ``nodes[loop]`` and the walk goes on from there forever. With `ends` it goes one step or chain further, up to a step
    that shows this letter; then the letters before were not looked at, which are all None.
    """

    nodes: tuple[int, ...]
    letters: tuple[Letters, ...]
    loop: int | None = None
    ends: int | None = None

    @property
    def shown(self) -> tuple[int, ...]:
        """The letters of all steps, one after the other."""
        words = ((each,) if isinstance(each, int) else each or () for each in self.letters)
        return tuple(letter for word in words for letter in word)


def walk(start: ProductNode, steps: Sequence[PathStep], loop: int | None = None) -> Walk:
    """The steps of a search as a walk; `loop` is the number of steps before the loop."""
    return Walk((start[0], *(s.target[0] for s in steps)), tuple(s.letter for s in steps), loop)


def join(stem: Walk, rest: Walk) -> Walk:
    """`stem`, which ends where `rest` begins, and then `rest`."""
    loop = None if rest.loop is None else len(stem.letters) + rest.loop
    return Walk((*stem.nodes, *rest.nodes[1:]), (*stem.letters, *rest.letters), loop)


JointStep = Callable[[int, int], Sequence[Move]]


class Cores:
    """The strongly connected components of an automaton whose moves inside are together in all acceptance sets.

    An accepting run stays in one of them from some point on. `step` gives the automaton's moves by state and letter.
    The states of cores have numbers of their own, 0, 1, …
    """

    def __init__(self, step: JointStep, letters: Sequence[int], sets: int, most: int) -> None:
        """`letters`: one of each class; at most `most` rows of moves are looked at."""
        self._step = step
        self._letters = letters
        self._full = (1 << sets) - 1
        self._left = most
        self._moves: dict[int, list[Move]] = {}
        self._core: dict[int, int] = {}
        self._useful: set[int] = set()
        self._states: list[int] = []
        self._numbers: dict[int, int] = {}
        self.unknown = False
        """There were too many rows: every state counts as one of a core, under its own number."""
        self.numbers: list[int] = []
        """By state: its number among the states of cores, or NO_STATE."""

    def add(self, states: Iterable[int]) -> None:
        """Look at what can be reached from these states."""
        todo = [state for state in dict.fromkeys(states) if state not in self._moves]
        if self.unknown or not todo:
            return
        while todo:
            state = todo.pop()
            if state in self._moves:
                continue
            tick()
            self._left -= len(self._letters)
            if self._left < 0:
                self.unknown = True
                return
            row = dict.fromkeys(move for letter in self._letters for move in self._step(state, letter))
            self._moves[state] = list(row)
            todo += [target for target, _ in row]
        self._divide()

    @property
    def single(self) -> bool:
        """Every state that was looked at is in the same core, or is taken to be."""
        return self.unknown or (len(self._core) == len(self._moves) and len(set(self._core.values())) == 1)

    def is_useful(self, state: int) -> bool:
        """Whether a core can be reached."""
        return self.unknown or state in self._useful

    def toward(self, state: int, letter: int) -> Iterable[Move]:
        """The moves from which a core can be reached."""
        return [move for move in self._step(state, letter) if self.is_useful(move[0])]

    def inside(self, number: int, letter: int) -> Sequence[Move]:
        """The moves inside a core, by numbers of the states of cores."""
        if self.unknown:
            return self._step(number, letter)
        state = self._states[number]
        core = self._core[state]
        moves = self._step(state, letter)
        return [(self._numbers[target], mask) for target, mask in moves if self._core.get(target) == core]

    def _divide(self) -> None:
        states = sorted(self._moves)
        place = {state: i for i, state in enumerate(states)}
        parts = components([[place[target] for target, _ in self._moves[state]] for state in states])
        shown: dict[int, int] = {}
        for state, part in zip(states, parts, strict=True):
            for target, mask in self._moves[state]:
                if parts[place[target]] == part:
                    shown[part] = shown.get(part, 0) | mask
        cores = {part for part, mask in shown.items() if mask == self._full}
        useful = set(cores)
        # Edges never lead to a component of a higher number.
        for part, state in sorted(zip(parts, states, strict=True)):
            if any(parts[place[target]] in useful for target, _ in self._moves[state]):
                useful.add(part)
        self._core = {state: part for state, part in zip(states, parts, strict=True) if part in cores}
        self._useful = {state for state, part in zip(states, parts, strict=True) if part in useful}
        for state in self._core:
            if self._numbers.setdefault(state, len(self._states)) == len(self._states):
                self._states.append(state)
        self.numbers = [self._numbers.get(state, NO_STATE) for state in range(max(states) + 1)]


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


class _Loops(Closing):
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
