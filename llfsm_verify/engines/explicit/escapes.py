"""Where the arrangement escapes its assumptions: the nearest configuration from which no run meets them any more.

docs/semantics.md has the definition. The automata of the assumptions are followed in sets of their states, as bad
prefixes are, so that a product node stands for all that the letters read so far leave possible.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.moves import Lazy, moves_of
from llfsm_verify.kripke.lassos import walk
from llfsm_verify.kripke.paths import Components, Living
from llfsm_verify.kripke.product import MAX_SETS, EdgeClasses, Move, ProductNode, Reading, Rows
from llfsm_verify.kripke.product_search import Product, States, Walk
from llfsm_verify.limits import LimitReached, tick

MAX_BITS = 12
"""Atoms of an automaton that is made as it is asked for, up to which all of its letters are tried."""
ALL_WORK = 1 << 60


@dataclass(frozen=True, slots=True)
class Assumed:
    """The automaton of an assumption, and the names of its bits."""

    automaton: Automaton | Lazy
    atoms: tuple[str, ...]


class Meetable:
    """Tells whether several automata have a word in common from given states, whatever an arrangement does."""

    def __init__(self, assumed: Sequence[Assumed]) -> None:
        self._moves = [moves_of(each.automaton) for each in assumed]
        self._assumed = assumed
        self._sets = sum(move.acceptance_sets for move in self._moves)
        names = sorted({name for each in assumed for name in each.atoms})
        self._bits = {name: i for i, name in enumerate(names)}
        self._rows: dict[tuple[int, int], tuple[Edge, ...]] = {}
        self._known: dict[Hashable, bool] = {}

    def __call__(self, states: Iterable[States], fixed: dict[str, bool]) -> bool:
        """Whether there is such a word from one of `states`, in which atoms keep the values `fixed`. LimitReached."""
        starts = frozenset(states)
        on = sum(1 << self._bits[name] for name, holds in fixed.items() if holds and name in self._bits)
        off = sum(1 << self._bits[name] for name, holds in fixed.items() if not holds and name in self._bits)
        key = starts, on, off
        if key not in self._known:

            def successors(at: States) -> Iterator[tuple[None, int, States]]:
                return ((None, acceptance, target) for acceptance, target in self._joint(at, on, off))

            self._known[key] = find_accepting_lasso(sorted(starts), successors, self._sets) is not None
        return self._known[key]

    def _joint(self, states: States, on: int, off: int) -> Iterator[tuple[int, States]]:
        """The moves of all automata with a letter in common: the acceptance, and where they lead to."""
        found: dict[tuple[int, States, int, int], None] = {(0, (), on, off): None}
        shift = 0
        for number, state in enumerate(states):
            further: dict[tuple[int, States, int, int], None] = {}
            for acceptance, targets, positive, negative in found:
                for edge in self._row(number, state):
                    tick()
                    if not (positive & edge.negative or negative & edge.positive):
                        more = (*targets, edge.target)
                        both = positive | edge.positive, negative | edge.negative
                        further[acceptance | edge.acceptance << shift, more, *both] = None
            found = further
            shift += self._moves[number].acceptance_sets
        return iter(dict.fromkeys((acceptance, targets) for acceptance, targets, _, _ in found))

    def _row(self, number: int, state: int) -> tuple[Edge, ...]:
        """The edges of one automaton from a state, over the bits of all."""
        row = self._rows.get((number, state))
        if row is None:
            each = self._assumed[number]
            bits = [1 << self._bits[name] for name in each.atoms]
            edges = (
                Edge(_moved(edge.positive, bits), _moved(edge.negative, bits), edge.target, edge.acceptance)
                for edge in self._edges(number, state)
            )
            row = self._rows[number, state] = tuple(dict.fromkeys(edges))
        return row

    def _edges(self, number: int, state: int) -> Iterator[Edge]:
        automaton = self._assumed[number].automaton
        if isinstance(automaton, Automaton):
            yield from automaton.edges[state]
            return
        relevant = automaton.relevant
        if relevant.bit_count() > MAX_BITS:
            raise LimitReached(f"an assumption with bounds has more than {MAX_BITS} atoms")
        letter = relevant
        while True:
            for acceptance, target in automaton(state, letter):
                yield Edge(letter, relevant & ~letter, target, acceptance)
            if not letter:
                return
            letter = (letter - 1) & relevant


def _moved(mask: int, bits: Sequence[int]) -> int:
    return sum(bit for i, bit in enumerate(bits) if mask >> i & 1)


class _Followed:
    """The automata of a product as one, which follows the sets of their states and may guess one of them at any time.

    In the first way every word has one run, which says what is possible after it; only the second, or a set of one
    state that stays one, is accepting.
    """

    def __init__(self, over: Product) -> None:
        self._over = over
        self._numbers: dict[tuple[frozenset[int], bool], int] = {}
        self._states: list[tuple[frozenset[int], bool]] = []
        self._nothing = self._number(frozenset(), True)
        """After a word that violates the assumptions in its middle."""

    @property
    def followed(self) -> list[int]:
        """By state: 1, or 0 for one that was guessed."""
        return [int(followed) for _, followed in self._states]

    def starts(self, first_letters: Sequence[int]) -> list[ProductNode]:
        roots: dict[int, list[int]] = {}
        for root, states in self._over.initial(first_letters):
            roots.setdefault(root, []).append(self._over.number(states))
        return [
            (root, state) for root, numbers in roots.items() for state, _ in self._moves({n: [0] for n in numbers}, 0)
        ]

    def step(self, state: int, letter: int) -> tuple[Move, ...]:
        states, followed = self._states[state]
        reached: dict[int, list[int]] = {}
        for each in states:
            for target, acceptance in self._over.step(each, letter):
                reached.setdefault(target, []).append(acceptance)
        if not followed:
            return tuple((self._number(frozenset((t,)), False), mask) for t, masks in reached.items() for mask in masks)
        return tuple(self._moves(reached, len(states)))

    def _moves(self, reached: dict[int, list[int]], before: int) -> Iterator[Move]:
        """From a set of `before` states to all that they can become."""
        everything = self._number(frozenset(reached), True)
        if len(reached) == before == 1:
            ((_, masks),) = reached.items()
            yield from ((everything, mask) for mask in masks)
        elif reached:
            yield everything, 0
            if len(reached) > 1:
                yield from ((self._number(frozenset((t,)), False), 0) for t in reached)

    def read(self, classes: EdgeClasses) -> Reading:
        return _Words(self, classes)

    def breaks(self, state: int, moves: Sequence[Move], first: int) -> tuple[Move, ...]:
        """The move of a whole word from `state` after which nothing is possible although something was after its
        `first` letter; `moves` are the others."""
        if not self._states[state][1] or any(self._states[target][1] for target, _ in moves):
            return ()
        return ((self._nothing, 0),) if self.step(state, first) else ()

    def _number(self, states: frozenset[int], followed: bool) -> int:
        number = self._numbers.setdefault((states, followed), len(self._states))
        if number == len(self._states):
            self._states.append((states, followed))
        return number


class _Words(Reading):
    """Also tells of words that violate the assumptions after their first letter: chains pass over what is between."""

    def __init__(self, followed: _Followed, classes: EdgeClasses) -> None:
        super().__init__(classes, followed.step)
        self._followed = followed
        self._labels = classes

    def __call__(self, state: int, label_class: int) -> tuple[Move, ...]:
        moves = super().__call__(state, label_class)
        labels, first = self._labels, label_class
        while labels.prefixes[first] >= 0:
            first = labels.prefixes[first]
        if first == label_class:
            return moves
        return (*moves, *self._followed.breaks(state, moves, labels.letters[labels.last[first]]))


@dataclass(frozen=True, slots=True)
class Question:
    """`assumed` accepts what meets the assumptions and is fair, `world` what meets those about inputs alone and is
    fair; `assumptions` are the first automata of `assumed`. `fixed` are atoms that never change, by their bits."""

    assumed: Product
    world: Product
    assumptions: Sequence[Assumed]
    fixed: dict[str, int]
    first_letters: Sequence[int]


def find_escape(question: Question) -> Walk | None:
    """The shortest walk to where the assumptions are escaped; None: nowhere. LimitReached.

    The graph is complete, and some run of it meets the assumptions.
    """
    assumed, graph = question.assumed, question.assumed.graph
    if assumed.sets > MAX_SETS:
        raise LimitReached(f"the assumptions have more than {MAX_SETS} acceptance sets")
    automaton, classes = _Followed(assumed), EdgeClasses(graph, assumed.bits)
    starts = automaton.starts(question.first_letters)
    with (
        Rows(classes, automaton.step, read=automaton.read(classes)) as rows,
        Components(graph, rows, assumed.sets, assumed.sizes) as components,
    ):
        if not components.search(starts):
            return None
        components.collect(ALL_WORK)
        world = question.world
        with (
            Living(graph, rows, starts, components, assumed.sizes) as living,
            world.search(world.initial(question.first_letters)) as others,
        ):
            living.sweep()
            can_be_met = Meetable(question.assumptions)
            for number in living.lost(automaton.followed):
                tick()
                if graph.has_silent_edges and graph.in_cycle(living.node(number)[0]):
                    continue
                start, steps = living.path(number)
                whole = walk(start, steps)
                found = _until_lost(whole)
                root = found.nodes[0]
                letters = (question.first_letters[root], *found.shown)
                count = len(question.assumptions)
                possible = {states[:count] for states in _after(assumed, root, question.first_letters, found)}
                fixed = {name: bool(letters[-1] >> bit & 1) for name, bit in question.fixed.items()}
                if not can_be_met(possible, fixed):
                    continue
                end = whole.nodes[-1]
                if others.accepts([(end, s) for s in _after(world, root, question.first_letters, whole)]):
                    return found
    return None


def _until_lost(whole: Walk) -> Walk:
    """Of a last chain only the first letter: what follows it has no choice."""
    last = whole.letters[-1] if whole.letters else None
    if not isinstance(last, tuple):
        return whole
    return Walk(whole.nodes, (*whole.letters[:-1], last[:1]))


def _after(over: Product, root: int, first_letters: Sequence[int], read: Walk) -> frozenset[States]:
    """What the automata of a product can be in after a walk from a root."""
    states = frozenset(over.number(s) for at, s in over.initial(first_letters) if at == root)
    for letter in read.shown:
        states = frozenset(target for state in states for target, _ in over.step(state, letter))
    return frozenset(map(over.states, states))
