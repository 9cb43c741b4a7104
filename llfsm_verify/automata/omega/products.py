"""Products: automata of what is reached together, a word in an automaton, and two automata side by side, with the words
that both accept."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Sequence
from typing import TypeVar

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.limits import tick

Pair = tuple[int, int]


NodeT = TypeVar("NodeT", bound=Hashable)


def explore(
    first: NodeT,
    following: Callable[[NodeT], Iterable[tuple[int, int, NodeT, int]]],
    atoms: Sequence[str],
    acceptance_sets: int,
    max_states: int,
    max_edges: int | None = None,
) -> Automaton:
    """The automaton whose states are the nodes that are reached from `first`.

    `following`: the transitions of a node: positive and negative atoms, target, acceptance. AutomatonTooLarge: more
    states or transitions than the limits.
    """
    numbers = {first: 0}
    queue = [first]
    rows: list[tuple[Edge, ...]] = []
    made = 0
    for node in queue:
        tick()
        row: dict[Edge, None] = {}
        for positive, negative, target, acceptance in following(node):
            number = numbers.setdefault(target, len(queue))
            if number == len(queue):
                queue.append(target)
                if len(queue) > max_states:
                    raise AutomatonTooLarge("states", max_states)
            row[Edge(positive, negative, number, acceptance)] = None
        rows.append(tuple(row))
        made += len(row)
        if max_edges is not None and made > max_edges:
            raise AutomatonTooLarge("transitions", max_edges)
    return Automaton(tuple(atoms), tuple(rows), acceptance_sets)


def accepts(automaton: Automaton, stem: Sequence[Collection[str]], loop: Sequence[Collection[str]]) -> bool:
    """Whether the word `stem` `loop` `loop` … is in the language; letters are given by the keys of their true atoms."""
    if not loop:
        raise ValueError("a lasso needs a loop")
    letters = [automaton.letter(letter) for letter in (*stem, *loop)]

    def successors(node: Pair) -> Iterator[tuple[Edge, int, Pair]]:
        state, i = node
        following = i + 1 if i + 1 < len(letters) else len(stem)
        for edge in automaton.edges[state]:
            if edge.allows(letters[i]):
                yield edge, edge.acceptance, (edge.target, following)

    initial = [] if automaton.is_empty else [(0, 0)]
    return find_accepting_lasso(initial, successors, automaton.acceptance_sets) is not None


def disjoint(left: Automaton, right: Automaton, *, closure: bool = False) -> bool:
    """Whether no word is in both languages. `closure`: take the closure of the left one, all runs of which count.

    The automata have the same atoms (ValueError).
    """
    if closure:
        rows = tuple(tuple(Edge(e.positive, e.negative, e.target, 0) for e in row) for row in left.edges)
        left = Automaton(left.atoms, rows, 0)
    return common_word(left, right) is None


Letter = tuple[tuple[str, bool], ...]
"""The atoms that matter, each with its truth."""
Word = tuple[tuple[Letter, ...], tuple[Letter, ...]]
"""A stem and a loop."""


def accepted_word(automaton: Automaton) -> Word | None:
    """A word that `automaton` accepts, on a shortest way to a loop; None: it accepts no word."""
    return common_word(automaton, Automaton(automaton.atoms, ((),), 0), alone=True)


def common_word(left: Automaton, right: Automaton, *, alone: bool = False) -> Word | None:
    """A word that both accept; None: they share none. The atoms are the same (ValueError). `alone`: `left` alone."""
    if left.atoms != right.atoms:
        raise ValueError("the automata have different atoms")

    def successors(pair: tuple[int, int]) -> Iterator[tuple[tuple[int, int], int, tuple[int, int]]]:
        for a in left.edges[pair[0]]:
            if alone:
                yield (a.positive, a.negative), a.acceptance, (a.target, 0)
                continue
            for b in right.edges[pair[1]]:
                if not (a.positive & b.negative or a.negative & b.positive):
                    label = a.positive | b.positive, a.negative | b.negative
                    yield label, a.acceptance | b.acceptance << left.acceptance_sets, (a.target, b.target)

    initial = [] if left.is_empty or right.is_empty else [(0, 0)]
    sets = left.acceptance_sets + (0 if alone else right.acceptance_sets)
    found = find_accepting_lasso(initial, successors, sets)
    if found is None:
        return None

    def letter(label: tuple[int, int]) -> Letter:
        positive, negative = label
        return tuple(
            (key, bool(positive >> i & 1)) for i, key in enumerate(left.atoms) if (positive | negative) >> i & 1
        )

    return tuple(letter(label) for label, _ in found.stem), tuple(letter(label) for label, _ in found.loop)


def is_deterministic(automaton: Automaton) -> bool:
    """No letter allows two transitions of one state (to different targets or with different acceptance)."""
    for row in automaton.edges:
        for i, a in enumerate(row):
            for b in row[:i]:
                different = (a.target, a.acceptance) != (b.target, b.acceptance)
                if different and not (a.positive & b.negative or a.negative & b.positive):
                    return False
    return True


def transitions(automaton: Automaton) -> int:
    """The number of transitions, those of equal ends and acceptance counted once whatever letters they are for."""
    return sum(len({(e.target, e.acceptance) for e in row}) for row in automaton.edges)
