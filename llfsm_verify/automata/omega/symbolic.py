"""Automata while they are being made smaller: transitions labelled with sets of letters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Generic

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.labels import MAX_CUBES, Alphabet, Cube, L, cubes, of_cube
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso

Arc = tuple[L, int, int]
"""A transition: the letters, the mask of its acceptance sets, the target."""


@dataclass(frozen=True, slots=True)
class Symbolic(Generic[L]):
    """A transition-based generalised Büchi automaton; state 0 is initial, no states: the empty language.

    In a row no two arcs have the same acceptance and target, and no label is empty.
    """

    alphabet: Alphabet[L]
    rows: tuple[tuple[Arc[L], ...], ...]
    sets: int

    @property
    def full(self) -> int:
        """The mask of all acceptance sets."""
        return (1 << self.sets) - 1

    def components(self) -> list[int]:
        """The component of each state; arcs never lead to a higher number."""
        return components([[target for _, _, target in row] for row in self.rows])


def share_a_word(left: Sequence[Sequence[Arc[L]]], sets: int, right: Symbolic[L]) -> bool:
    """Whether some word has a run in `left`, rows with so many acceptance sets, and in `right` that both accept."""

    def successors(pair: tuple[int, int]) -> list[tuple[None, int, tuple[int, int]]]:
        return [
            (None, acceptance << sets | own, (target, reached))
            for label, own, target in left[pair[0]]
            for other, acceptance, reached in right.rows[pair[1]]
            if label & other
        ]

    starts = [(0, 0)] if left and right.rows else []
    return find_accepting_lasso(starts, successors, sets + right.sets) is not None


def merged_row(arcs: Iterable[Arc[L]]) -> tuple[Arc[L], ...]:
    """`arcs` with those of equal acceptance and target united, and without empty ones."""
    labels: dict[tuple[int, int], L] = {}
    for label, acceptance, target in arcs:
        if label:
            key = (target, acceptance)
            known = labels.get(key)
            labels[key] = label if known is None else known | label
    return tuple((label, acceptance, target) for (target, acceptance), label in labels.items())


def kept(graph: Symbolic[L], keep: Sequence[bool], initial: int = 0) -> Symbolic[L]:
    """The states to keep that are reachable from `initial` through such states, renumbered breadth first."""
    if not graph.rows or not keep[initial]:
        return Symbolic(graph.alphabet, (), graph.sets)
    numbers = {initial: 0}
    order = [initial]
    for state in order:
        for _, _, target in graph.rows[state]:
            if keep[target] and target not in numbers:
                numbers[target] = len(order)
                order.append(target)
    rows = tuple(
        tuple((label, acceptance, numbers[target]) for label, acceptance, target in graph.rows[q] if keep[target])
        for q in order
    )
    return Symbolic(graph.alphabet, rows, graph.sets)


def from_automaton(automaton: Automaton, alphabet: Alphabet[L]) -> Symbolic[L]:
    """`automaton`, whose atom i is the alphabet's."""
    known: dict[tuple[int, int], L] = {}

    def label(edge: Edge) -> L:
        cube = (edge.positive, edge.negative)
        if cube not in known:
            known[cube] = of_cube(alphabet, *cube)
        return known[cube]

    rows = tuple(merged_row((label(e), e.acceptance, e.target) for e in row) for row in automaton.edges)
    return Symbolic(alphabet, rows, automaton.acceptance_sets)


def mentioned(*automata: Automaton) -> list[int]:
    """The places of the atoms that edges of `automata` look at, ascending."""
    used = 0
    for row in (row for a in automata for row in a.edges):
        for edge in row:
            used |= edge.positive | edge.negative
    return [i for i in range(used.bit_length()) if used >> i & 1]


def narrowed(automaton: Automaton, places: Sequence[int]) -> Automaton:
    """Over the atoms at `places` only, which are all that its edges look at."""

    def narrow(mask: int) -> int:
        return sum(1 << i for i, place in enumerate(places) if mask >> place & 1)

    rows = tuple(
        tuple(replace(e, positive=narrow(e.positive), negative=narrow(e.negative)) for e in row)
        for row in automaton.edges
    )
    return Automaton(tuple(automaton.atoms[place] for place in places), rows, automaton.acceptance_sets)


def cubes_at(alphabet: Alphabet[L], label: L, places: Sequence[int]) -> list[Cube]:
    """`label` as cubes over more atoms, where the alphabet's atom i is at `places[i]`. AutomatonTooLarge."""

    def widened(mask: int) -> int:
        wide = 0
        while mask:
            low = mask & -mask
            wide |= 1 << places[low.bit_length() - 1]
            mask ^= low
        return wide

    return [(widened(positive), widened(negative)) for positive, negative in cubes(alphabet, label)]


def to_automaton(graph: Symbolic[L], keys: tuple[str, ...], places: Sequence[int]) -> Automaton:
    """The automaton over the atoms `keys`; `places[i]` is the place of the alphabet's atom i among them.

    AutomatonTooLarge: it takes more than `MAX_CUBES` transitions.
    """
    known: dict[L, list[tuple[int, int]]] = {}

    rows: list[tuple[Edge, ...]] = []
    made = 0
    for row in graph.rows:
        edges: list[Edge] = []
        for label, acceptance, target in row:
            if label not in known:
                known[label] = cubes_at(graph.alphabet, label, places)
            edges += (Edge(p, n, target, acceptance) for p, n in known[label])
        made += len(edges)
        if made > MAX_CUBES:
            raise AutomatonTooLarge("transitions", MAX_CUBES)
        rows.append(tuple(edges))
    return Automaton(keys, tuple(rows), graph.sets)
