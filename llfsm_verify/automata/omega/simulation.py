"""Quotients: states that can do the same (forwards), or were reached in the same way (backwards), become one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence

from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.refinement import coarsest
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, kept, merged_row
from llfsm_verify.limits import tick

MAX_ARCS = 1_000
"""Automata with more transitions are only reduced by bisimulation: simulation compares all pairs of transitions."""

MAX_COMPARISONS = 300_000
"""Where the states that simulate others are not known after so many comparisons of two states, none are merged."""

Rows = Sequence[Sequence[Arc[L]]]


def bisimulation(graph: Symbolic[L]) -> Symbolic[L]:
    """States with equal futures become one: the coarsest partition, by refinement from one class."""

    def step(state: int, block: Sequence[int]) -> frozenset[Arc[L]]:
        return frozenset(merged_row((label, a, block[target]) for label, a, target in graph.rows[state]))

    classes = coarsest([{target for _, _, target in row} for row in graph.rows], step, [0] * len(graph.rows))
    first: dict[int, int] = {}
    for state, number in enumerate(classes):
        first.setdefault(number, state)
    if len(first) == len(classes):
        return graph
    return _quotient(graph, [first[number] for number in classes])


def direct_simulation(graph: Symbolic[L]) -> Symbolic[L]:
    """The quotient by direct simulation, without transitions that others to a better state make needless.

    A state is simulated by another one that can follow each of its transitions with at least the same acceptance, and
    so on. Source: Etessami and Holzmann, Optimizing Büchi automata, CONCUR 2000; for transition-based acceptance and
    symbolic labels Babiak et al., SPIN 2013.
    """
    if _is_large(graph):
        return graph
    above = simulating(graph)
    rows = tuple(
        tuple(_without_smaller(row, lambda t, u: bool((above[t] >> u & 1 and not above[u] >> t & 1) or t == u)))
        for row in graph.rows
    )
    return _quotient(Symbolic(graph.alphabet, rows, graph.sets), _classes(above))


def simulating(graph: Symbolic[L]) -> list[int]:
    """For each state the mask of those that simulate it, hence accept all that it accepts; just itself if too large."""
    n = len(graph.rows)
    if _is_large(graph):
        return [1 << q for q in range(n)]
    labels = [_united(graph, row) for row in graph.rows]
    above = [(1 << n) - 1] * n
    for q in range(n):
        for p in range(n):
            if labels[q] & ~labels[p]:
                above[q] &= ~(1 << p)
    return above if _refine(graph.rows, above, range(n - 1, -1, -1)) else [1 << q for q in range(n)]


def reverse_simulation(graph: Symbolic[L], *, by_state: bool = False) -> Symbolic[L]:
    """The same backwards in time. `by_state`: states are not merged unless their transitions have equal acceptance."""
    n = len(graph.rows)
    if n == 0 or _is_large(graph):
        return graph
    incoming: list[list[Arc[L]]] = [[] for _ in range(n)]
    for source, row in enumerate(graph.rows):
        for label, acceptance, target in row:
            incoming[target].append((label, acceptance, source))
    above = [(1 << n) - 1] * n
    above[0] = 1
    if by_state:
        marks = [max((a for _, a, _ in row), default=0) for row in graph.rows]
        for q in range(n):
            for p in range(n):
                if marks[q] != marks[p]:
                    above[q] &= ~(1 << p)
    if not _refine(incoming, above, range(n)):
        return graph
    rows: list[list[Arc[L]]] = [[] for _ in range(n)]
    for target, arcs in enumerate(incoming):
        better = _without_smaller(arcs, lambda s, u: bool((above[s] >> u & 1 and not above[u] >> s & 1) or s == u))
        for label, acceptance, source in better:
            rows[source].append((label, acceptance, target))
    classes = _classes(above)
    for state, representative in enumerate(classes):
        if representative != state:
            rows[representative] += rows[state]
    return _quotient(Symbolic(graph.alphabet, tuple(map(tuple, rows)), graph.sets), classes)


def _is_large(graph: Symbolic[L]) -> bool:
    return sum(map(len, graph.rows)) > MAX_ARCS


def _united(graph: Symbolic[L], row: Sequence[Arc[L]]) -> L:
    label = graph.alphabet.false
    for part, _, _ in row:
        label = label | part
    return label


def _refine(rows: Rows[L], above: list[int], order: Sequence[int]) -> bool:
    """Shrink `above[q]`, the states that may simulate q, to the greatest simulation. False: too much work, not done.

    Each pair is compared once, states in `order` (best: targets before sources), and again only when a pair after it
    has been lost. Source: Henzinger, Henzinger and Kopke, Computing simulations on finite and infinite graphs, FOCS
    1995.
    """
    before = [0] * len(rows)
    for q, row in enumerate(rows):
        for _, _, target in row:
            before[target] |= 1 << q
    left = MAX_COMPARISONS
    lost = [0] * len(rows)
    due: deque[int] = deque()

    def compare(q: int, candidates: int) -> bool:
        nonlocal left
        tick()
        gone = 0
        for p in _members(candidates & ~(1 << q)):
            left -= 1
            if left < 0:
                return False
            if not _follows(rows[q], rows[p], above):
                gone |= 1 << p
        lose(q, gone)
        return True

    def lose(q: int, gone: int) -> None:
        if gone:
            above[q] &= ~gone
            if not lost[q]:
                due.append(q)
            lost[q] |= gone

    seen = 0
    for state in order:
        seen |= 1 << state
        # Who cannot even go to a better state than this transition needs no comparison.
        able = above[state]
        for target in {target for _, _, target in rows[state]}:
            able &= _united_masks(before, above[target])
        lose(state, above[state] & ~able & ~(1 << state))
        if not compare(state, above[state]):
            return False
        while due:  # at once, so that the states that follow find fewer pairs left
            target = due.popleft()
            suspects, lost[target] = _united_masks(before, lost[target]), 0
            for q in _members(before[target] & seen):
                if not compare(q, above[q] & suspects):
                    return False
    return True


def _members(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def _united_masks(masks: Sequence[int], chosen: int) -> int:
    result = 0
    for i in _members(chosen):
        result |= masks[i]
    return result


def _follows(row: Sequence[Arc[L]], other: Sequence[Arc[L]], above: list[int]) -> bool:
    for label, acceptance, target in row:
        better = above[target]
        rest = label
        for offered, mask, reached in other:
            if better >> reached & 1 and not acceptance & ~mask:
                rest = rest & ~offered
                if not rest:
                    break
        else:
            return False
    return True


def _without_smaller(row: Sequence[Arc[L]], smaller: Callable[[int, int], bool]) -> list[Arc[L]]:
    """`row` without the letters for which a transition with no less acceptance leads to a better state.

    `smaller(t, u)`: t is below u, or the same.
    """
    if len(row) < 2:
        return list(row)
    found: list[Arc[L]] = []
    for label, acceptance, target in row:
        for other, mask, reached in row:
            same = target == reached and acceptance == mask
            if not same and not acceptance & ~mask and smaller(target, reached):
                label = label & ~other
                if not label:
                    break
        else:
            found.append((label, acceptance, target))
    return found


def _classes(above: list[int]) -> list[int]:
    """The lowest of the states that simulate each other, for each state."""
    classes: list[int] = []
    for q, mask in enumerate(above):
        both = q
        while mask:
            low = mask & -mask
            p = low.bit_length() - 1
            if p >= q:
                break
            if above[p] >> q & 1:
                both = p
                break
            mask ^= low
        classes.append(both)
    return classes


def _quotient(graph: Symbolic[L], classes: Sequence[int]) -> Symbolic[L]:
    """One state for each class, with the row of the member that names it; what cannot be reached is dropped."""
    rows = tuple(
        merged_row((label, acceptance, classes[target]) for label, acceptance, target in row) if classes[q] == q else ()
        for q, row in enumerate(graph.rows)
    )
    return kept(Symbolic(graph.alphabet, rows, graph.sets), [True] * len(rows))
