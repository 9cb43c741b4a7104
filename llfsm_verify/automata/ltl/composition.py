"""Automata of conjunctions and disjunctions from automata of the parts."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import L
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, kept, merged_row
from llfsm_verify.limits import tick


def union(parts: Sequence[Symbolic[L]]) -> Symbolic[L]:
    """The words that one of `parts` accepts, at least one part: a choice at the first letter."""
    sets = max(part.sets for part in parts)
    full = (1 << sets) - 1
    rows: list[tuple[Arc[L], ...]] = [()]
    initial: list[Arc[L]] = []
    for part in parts:
        shift, always = len(rows), full & ~part.full  # a part with fewer sets meets the missing ones at every letter
        rows += (tuple((label, mask | always, target + shift) for label, mask, target in row) for row in part.rows)
        if part.rows:
            initial += rows[shift]
    if not initial:
        return Symbolic(parts[0].alphabet, (), 0)
    rows[0] = merged_row(initial)
    return kept(Symbolic(parts[0].alphabet, tuple(rows), sets), [True] * len(rows))


def intersection(left: Symbolic[L], right: Symbolic[L], max_states: int, max_steps: int) -> Symbolic[L]:
    """The words that both accept: the product. AutomatonTooLarge: it has more states or transitions."""
    if not left.rows or not right.rows:
        return Symbolic(left.alphabet, (), 0)
    numbers = {(0, 0): 0}
    queue = [(0, 0)]
    rows: list[tuple[Arc[L], ...]] = []
    made = 0
    for here, there in queue:
        tick()
        row: list[Arc[L]] = []
        for label, acceptance, target in left.rows[here]:
            for other, further, reached in right.rows[there]:
                both = label & other
                if both:
                    pair = (target, reached)
                    number = numbers.setdefault(pair, len(queue))
                    if number == len(queue):
                        queue.append(pair)
                        if len(queue) > max_states:
                            raise AutomatonTooLarge("states", max_states)
                    row.append((both, acceptance | further << left.sets, number))
        made += len(row)
        if made > max_steps:
            raise AutomatonTooLarge("transitions", max_steps)
        rows.append(merged_row(row))
    return Symbolic(left.alphabet, tuple(rows), left.sets + right.sets)
