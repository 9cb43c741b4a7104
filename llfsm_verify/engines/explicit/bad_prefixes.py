"""Bad prefixes in an explored graph: the shortest one, and those that go on as a run which satisfies assumptions."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial

from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.lassos import Walk, join, walk
from llfsm_verify.kripke.paths import Breadth, PathStep, SearchTarget
from llfsm_verify.kripke.product import SIZES, EdgeClasses, Move, ProductNode, Rows, Sizes
from llfsm_verify.kripke.product_search import LassoSearch, Node, Product, Projection

BAD = 0
"""The state of a monitor after a bad prefix; its other states follow."""


def shortest_bad_prefix(
    graph: Graph, first_letters: Sequence[int], monitor: PrefixMonitor, project: Projection, sizes: Sizes = SIZES
) -> Walk | None:
    """A shortest walk whose letters are a bad prefix, by breadth-first search of graph × monitor.

    `first_letters` are the letters of the graph's roots. Source: Kupferman and Vardi, Model Checking of Safety
    Properties, FMSD 2001 (bad prefixes by subset construction).
    """
    start = monitor.initial()
    if start is None:
        return Walk((0,), ()) if graph.roots else None

    def step(state: int, letter: int) -> tuple[Move, ...]:
        following = None if state == BAD else monitor.step(state - 1, project(letter))
        return ((BAD, 1),) if following is None else ((following + 1, 0),)

    starts: list[ProductNode] = []
    for root in range(graph.roots):
        state = monitor.step(start, project(first_letters[root]))
        if state is None:
            return Walk((root,), ())
        starts.append((root, state + 1))
    with (
        Rows(EdgeClasses(graph, project.bits()), step, lambda state: state == BAD) as rows,
        Breadth(graph, rows, starts, goal=SearchTarget.FLAGGED, sizes=sizes) as search,
    ):
        found = search.next()
        return None if found is None else _ended(*search.path(found), step)


def _ended(start: ProductNode, steps: Sequence[PathStep], step: Callable[[int, int], tuple[Move, ...]]) -> Walk:
    """The walk up to the letter that completes the bad prefix: of a last chain, only the letters so far."""
    whole = walk(start, steps)
    before = steps[-2].target if len(steps) > 1 else start
    last, state = whole.letters[-1], before[1]
    if not isinstance(last, tuple):
        return whole
    for count, letter in enumerate(last, 1):
        state = step(state, letter)[0][0]
        if state == BAD:
            return Walk(whole.nodes, (*whole.letters[:-1], last[:count]))
    raise AssertionError("a bad prefix that its letters do not complete")


class _Guarded:
    """The automata of a product beside a monitor, which flags the moves that complete a bad prefix."""

    def __init__(self, assumed: Product, monitor: PrefixMonitor, project: Projection) -> None:
        self._assumed = assumed
        self._monitor = monitor
        self._project = project
        self._numbers: dict[tuple[int, int], int] = {}
        self.pairs: list[tuple[int, int]] = []
        """By state: the number of the automata's, and the monitor's."""
        self.bits = assumed.bits | project.bits()
        """The mask of what of a letter matters here."""

    def step(self, state: int, letter: int) -> tuple[Move, ...]:
        joint, watch = self.pairs[state]
        following = None if watch == BAD else self._monitor.step(watch - 1, self._project(letter))
        watch = BAD if following is None else following + 1
        targets = dict.fromkeys(target for target, _ in self._assumed.step(joint, letter))
        return tuple((self.number(target, watch), int(watch == BAD)) for target in targets)

    def ends(self, state: int) -> bool:
        """A bad prefix is complete."""
        return self.pairs[state][1] == BAD

    def number(self, joint: int, watch: int) -> int:
        number = self._numbers.setdefault((joint, watch), len(self.pairs))
        if number == len(self.pairs):
            self.pairs.append((joint, watch))
        return number


@dataclass(frozen=True, slots=True)
class _Prefixes:
    """Nodes where bad prefixes end, and the shortest way to them; None: they are roots."""

    ends: Sequence[Node]
    way: Callable[[], Walk] | None
    continuations: LassoSearch


def continued_bad_prefix(
    first_letters: Sequence[int], monitor: PrefixMonitor, project: Projection, assumed: Product
) -> Walk | None:
    """A shortest bad prefix that goes on as a run which `assumed` accepts, with that continuation; None: there is none.

    The bad prefixes are taken in the order of their lengths; what one search for a continuation has seen in vain the
    next ones pass over, so that all of them together take the time of one.
    """
    with closing(_bad_prefixes(first_letters, monitor, project, assumed)) as prefixes:
        for prefix in prefixes:
            rest = prefix.continuations.lasso(prefix.ends)
            if rest is not None:
                return rest if prefix.way is None else join(prefix.way(), rest)
    return None


def has_continued_bad_prefix(
    first_letters: Sequence[int], monitor: PrefixMonitor, project: Projection, assumed: Product
) -> bool:
    """Whether there is a bad prefix that goes on as a run which `assumed` accepts; without the time for a short one."""
    with closing(_bad_prefixes(first_letters, monitor, project, assumed)) as prefixes:
        return any(prefix.continuations.accepts(prefix.ends) for prefix in prefixes)


def _bad_prefixes(
    first_letters: Sequence[int], monitor: PrefixMonitor, project: Projection, assumed: Product
) -> Generator[_Prefixes, None, None]:
    """The bad prefixes in the order of their lengths, one for each node where they end."""
    start = monitor.initial()
    good: list[tuple[Node, int]] = []
    bad: list[Node] = []
    first = assumed.initial(first_letters)
    for node in first:
        state = None if start is None else monitor.step(start, project(first_letters[node[0]]))
        if state is None:
            bad.append(node)
        else:
            good.append((node, state + 1))
    with assumed.search(first) as continuations:
        yield _Prefixes(bad, None, continuations)
        guarded = _Guarded(assumed, monitor, project)
        starts = [(node, guarded.number(assumed.number(states), state)) for (node, states), state in good]
        graph, sizes = assumed.graph, assumed.sizes
        with (
            Rows(EdgeClasses(graph, guarded.bits), guarded.step, guarded.ends) as rows,
            Breadth(graph, rows, starts, goal=SearchTarget.FLAGGED, sizes=sizes) as search,
        ):
            while (found := search.next()) is not None:
                at, product_state = search.node(found)
                ends = [(at, assumed.states(guarded.pairs[product_state][0]))]
                yield _Prefixes(ends, partial(_way, search, found), continuations)


def _way(search: Breadth, found: int) -> Walk:
    return walk(*search.path(found))
