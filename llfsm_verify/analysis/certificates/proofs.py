"""Proofs that a property holds: the product states that can be reached, with their ranks."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.analysis.certificates.configurations import MOST_STATES, TooLarge
from llfsm_verify.automata.omega.components import components
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product_search import Product
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


# ---- Ranks of product states: they never rise, and inside of each some acceptance set does not occur


def ranked(
    targets: Sequence[Sequence[int]], acceptance: Sequence[Sequence[int]], sets: int, what: str
) -> tuple[list[int], list[int]]:
    """The rank of each node, and of each rank the acceptance set that no edge inside it has.

    Node i has edges to ``targets[i]`` in the sets of the masks ``acceptance[i]``; there are `sets` sets, at least one.
    One rank where a set occurs nowhere, else as few as taking the components one by one, successors first, gives.
    Source: ranks of the complements of Büchi automata (Kupferman and Vardi, Weak alternating automata are not that
    weak, TOCL 2 (2001)), here of a product without accepting runs. Raises Disagreement when there is an accepting
    component: `what` does not hold.
    """
    shown = 0
    for masks in acceptance:
        for mask in masks:
            shown |= mask
    nowhere = [k for k in range(sets) if not shown >> k & 1]
    if nowhere:
        return [0] * len(targets), nowhere[: min(1, len(targets))]
    component = components(targets)
    members: list[list[int]] = [[] for _ in range(max(component, default=-1) + 1)]
    for node, number in enumerate(component):
        members[number].append(node)
    rank, named = [0] * len(component), list[int]()
    for number, nodes in enumerate(members):
        inside = below = 0
        least = -1
        for node in nodes:
            for target, mask in zip(targets[node], acceptance[node], strict=True):
                if component[target] == number:
                    inside |= mask
                elif rank[target] > least:
                    least, below = rank[target], mask
                elif rank[target] == least:
                    below |= mask
        level = max(least, 0)
        if least >= 0 and (inside | below) >> named[least] & 1:
            level = least + 1
        while level < len(named) and inside >> named[level] & 1:
            level += 1
        if level == len(named):
            missing = [k for k in range(sets) if not inside >> k & 1]
            if not missing:
                raise Disagreement(f"{what}: the product has an accepting component, although the search found none")
            named.append(missing[0])
        for node in nodes:
            rank[node] = level
    return rank, named
