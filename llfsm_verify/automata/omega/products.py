"""Products: a word in an automaton, and two automata side by side."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso

Pair = tuple[int, int]


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
    if left.atoms != right.atoms:
        raise ValueError("the automata have different atoms")
    sets = 0 if closure else left.acceptance_sets

    def successors(pair: Pair) -> Iterator[tuple[None, int, Pair]]:
        for a in left.edges[pair[0]]:
            for b in right.edges[pair[1]]:
                if not (a.positive & b.negative or a.negative & b.positive):
                    acceptance = b.acceptance << sets | (0 if closure else a.acceptance)
                    yield None, acceptance, (a.target, b.target)

    initial = [] if left.is_empty or right.is_empty else [(0, 0)]
    return find_accepting_lasso(initial, successors, sets + right.acceptance_sets) is None
