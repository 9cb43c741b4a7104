"""States beside the subset that they stand in: is the language a persistence property?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.subsets import Subsets
from llfsm_verify.automata.omega.symbolic import Symbolic
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
    bit = 1 << opposite.sets

    def successors(pair: tuple[int, int]) -> list[tuple[None, int, tuple[int, int]]]:
        node, state = pair
        steps: list[tuple[None, int, tuple[int, int]]] = []
        here = found.component[node]
        for label, following in found.rows[node]:
            # Components are left forever: a run that ends in one is good when its last transitions are inside it.
            inside = bit if found.good[node] and found.component[following] == here else 0
            for other, acceptance, target in opposite.rows[state]:
                if label & other:
                    steps.append((None, acceptance | inside, (following, target)))
        return steps

    if not found.nodes or not opposite.rows:
        return True
    return find_accepting_lasso([(0, 0)], successors, opposite.sets + 1) is None
