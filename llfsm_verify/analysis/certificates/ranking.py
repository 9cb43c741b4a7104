"""Ranks of product states: they never rise, and inside of each some acceptance set does not occur."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.omega.components import components
from llfsm_verify.diagnostics import Disagreement


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
