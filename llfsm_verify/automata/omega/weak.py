"""Obligations: the minimal deterministic weak automaton, unique for each language that has one."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.labels import Alphabet, L
from llfsm_verify.automata.omega.augmented import Augmented
from llfsm_verify.automata.omega.refinement import equivalent
from llfsm_verify.automata.omega.subsets import Subsets
from llfsm_verify.automata.omega.symbolic import Symbolic, kept, merged_row, share_a_word


def weak_components(found: Augmented[L], component: Sequence[int]) -> list[bool]:
    """For each component of the subsets, whether some accepted loop stays in it."""
    accepting = [False] * (max(component, default=-1) + 1)
    for (number, _), good in zip(found.nodes, found.good, strict=True):
        if good:
            accepting[component[number]] = True
    return accepting


def is_obligation(
    subsets: Subsets[L], component: Sequence[int], accepting: Sequence[bool], opposite: Symbolic[L]
) -> bool:
    """Whether the weak automaton on the subsets accepts no word of `opposite`, an automaton of the complement.

    It accepts all words of the language, and just these if any deterministic weak automaton does: Dax, Eisinger and
    Klaedtke, Mechanizing the powerset construction for restricted classes of omega-automata, ATVA 2007.
    """
    rows = [
        [(label, int(accepting[here]), target) for label, target in row]
        for row, here in zip(subsets.rows, component, strict=True)
    ]
    return not share_a_word(rows, 1, opposite)


def minimal_weak(
    alphabet: Alphabet[L], subsets: Subsets[L], component: Sequence[int], accepting: Sequence[bool]
) -> Symbolic[L]:
    """The minimal deterministic weak automaton of an obligation; all transitions of a state are accepting, or none.

    Source: Löding, Efficient minimization of deterministic weak omega-automata, IPL 79 (2001): components get colours
    such that the automaton can be minimised as if it read finite words.
    """
    if not subsets.rows:
        return Symbolic(alphabet, (), 0)
    colours = _colours(subsets, component, accepting)
    classes = equivalent(subsets.rows, [colours[c] % 2 for c in component])
    first: dict[int, int] = {}
    for number, block in enumerate(classes):
        first.setdefault(block, number)
    rows = tuple(
        merged_row((label, colours[component[number]] % 2, classes[target]) for label, target in subsets.rows[number])
        for number in first.values()
    )
    return kept(Symbolic(alphabet, rows, 1), [True] * len(rows))


def _colours(subsets: Subsets[L], component: Sequence[int], accepting: Sequence[bool]) -> list[int]:
    """Odd colours for accepting components, even ones for the others; never less than the successors' colours."""
    final = [0] * len(accepting)
    below: list[set[int]] = [set() for _ in accepting]
    for number, row in enumerate(subsets.rows):
        below[component[number]].update(component[target] for _, target in row)
    for here in range(len(accepting)):
        least = max((final[there] for there in below[here] if there != here), default=0)
        if here in below[here] and least % 2 != accepting[here]:
            least += 1
        final[here] = least
    return final
