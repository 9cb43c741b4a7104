"""States beside the subset that they stand in: is the language a persistence property, or an obligation, which has a
unique minimal deterministic weak automaton?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import Alphabet, L
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.refinement import equivalent
from llfsm_verify.automata.omega.subsets import Subsets
from llfsm_verify.automata.omega.symbolic import Symbolic, kept, merged_row, share_a_word
from llfsm_verify.limits import tick


@dataclass(frozen=True, slots=True)
class Augmented(Generic[L]):
    """The augmented subset construction: node k is state `nodes[k][1]`, reached by the words of subset `nodes[k][0]`.

    `rows[k]` are the steps (letters, node). `good[k]`: the node is on a loop of the subsets and the states together
    that meets every acceptance set. Source: Boker and Kupferman, Co-ing Büchi made tight and useful, LICS 2009.
    """

    nodes: tuple[tuple[int, int], ...]
    rows: tuple[tuple[tuple[L, int], ...], ...]
    component: tuple[int, ...]
    good: tuple[bool, ...]


def augment(graph: Symbolic[L], subsets: Subsets[L], max_steps: int) -> Augmented[L]:
    """AutomatonTooLarge beyond `max_steps` steps."""
    nodes: list[tuple[int, int]] = [(0, 0)] if subsets.rows else []
    numbers = {node: k for k, node in enumerate(nodes)}
    rows: list[tuple[tuple[L, int], ...]] = []
    marks: list[list[int]] = []
    made = 0
    for number, state in nodes:
        tick()
        row: list[tuple[L, int]] = []
        masks: list[int] = []
        for region, following in subsets.rows[number]:
            for label, acceptance, target in graph.rows[state]:
                both = region & label
                if both:
                    node = (following, target)
                    number_of_node = numbers.setdefault(node, len(nodes))
                    if number_of_node == len(nodes):
                        nodes.append(node)
                    row.append((both, number_of_node))
                    masks.append(acceptance)
        made += len(row)
        if made > max_steps:
            raise AutomatonTooLarge("transitions", max_steps)
        rows.append(tuple(row))
        marks.append(masks)
    component = components([[node for _, node in row] for row in rows])
    met: dict[int, int] = {}
    for k, steps in enumerate(rows):
        for (_, following), acceptance in zip(steps, marks[k], strict=True):
            if component[following] == component[k]:
                met[component[k]] = met.get(component[k], 0) | acceptance
    good = tuple(met.get(c) == graph.full for c in component)
    return Augmented(tuple(nodes), tuple(rows), tuple(component), good)


def persists(found: Augmented[L], opposite: Symbolic[L]) -> bool:
    """Whether the language is a persistence property; `opposite` is an automaton of its complement.

    A run that from some point on keeps to one good component says that the prefixes, as far as finite words can tell,
    could be continued by an accepted loop again and again. All accepted words have such a run; the language is a
    persistence property exactly when no other word has one (Boker and Kupferman).
    """
    # Components are left forever: a run that ends in one is good when its last transitions are inside it.
    rows = [
        [(label, int(good and found.component[target] == here), target) for label, target in row]
        for row, good, here in zip(found.rows, found.good, found.component, strict=True)
    ]
    return not share_a_word(rows, 1, opposite)


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
