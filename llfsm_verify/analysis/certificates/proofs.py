"""Proofs that a property holds: the product states that can be reached, with their ranks."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.analysis.certificates.configurations import MOST_STATES, TooLarge
from llfsm_verify.analysis.certificates.ranking import ranked
from llfsm_verify.engines.explicit.product_search import Product
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.limits import tick

Edges = Sequence[Sequence[tuple[int, int | None]]]


def edges_of(graph: Graph) -> list[list[tuple[int, int | None]]]:
    """The (successor, letter) pairs of every node of a complete graph."""
    found = []
    for node in range(len(graph)):
        tick()
        found.append(list(graph.edges(node)))
    return found


def proof_of(product: Product, edges: Edges, first: Sequence[int], what: str) -> Json:
    """The product states with ranks: `joint` lists the states of the automata, `nodes` has for each product state its
    configuration, the index in `joint` and the rank, `sets` an acceptance set of each rank.

    `first` are the letters of the roots. TooLarge: there are more than MOST_STATES states. Disagreement: a run is
    accepted.
    """
    own = product.sets - len(product.fair_bits)
    numbers: dict[tuple[int, int], int] = {}
    order: list[tuple[int, int]] = []
    targets: list[list[int]] = []
    acceptance: list[list[int]] = []

    def number(node: tuple[int, int]) -> int:
        found = numbers.setdefault(node, len(order))
        if found == len(order):
            if found >= MOST_STATES:
                raise TooLarge(f"its product has more than {MOST_STATES:,} states")
            order.append(node)
        return found

    for node, states in product.initial(first):
        number((node, product.number(states)))
    for here in order:  # it grows
        tick()
        to, masks = list[int](), list[int]()
        for target, letter in edges[here[0]]:
            for state, mask in ((here[1], 0),) if letter is None else product.step(here[1], letter):
                to.append(number((target, state)))
                low = mask & (1 << own) - 1
                masks.append(0 if letter is None else low | 1 << own | mask >> own << own + 1)
        targets.append(to)
        acceptance.append(masks)
    ranks, sets = ranked(targets, acceptance, product.sets + 1, what)
    joint = {state: i for i, state in enumerate(dict.fromkeys(state for _, state in order))}
    flat: list[Json] = []
    for (node, state), rank in zip(order, ranks, strict=True):
        flat += [node, joint[state], rank]
    return {"joint": [list(product.states(state)) for state in joint], "nodes": flat, "sets": list(sets)}
