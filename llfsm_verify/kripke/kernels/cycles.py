"""Counting the steps of configurations where a step is a whole cycle, by a search through the middle of cycles."""

from __future__ import annotations

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels.words import helper, kernel, load32, load64, store32, store64


@helper
def mark_closed(block: int) -> None:
    """Mark the roots, and what an edge that shows a letter leads to."""
    closed, targets, labels = (
        load64(block, b.PAIRS_CLOSED),
        load64(block, b.PAIRS_TARGETS),
        load64(block, b.PAIRS_LABELS),
    )
    for i in range(load64(block, b.PAIRS_ROOTS)):
        store32(closed, i, 1)
    for e in range(load64(load64(block, b.PAIRS_FIRST), load64(block, b.PAIRS_NODES))):
        if load32(labels, e) != b.NO_LABEL:
            store32(closed, load32(targets, e), 1)


@kernel("cycle_pairs")
def cycle_pairs(block: int) -> int:
    """Add the number of configurations that each of the next ones reaches by one cycle."""
    if load64(block, b.PAIRS_NEXT) == 0:
        mark_closed(block)
    closed, stamps, stack = load64(block, b.PAIRS_CLOSED), load64(block, b.PAIRS_STAMPS), load64(block, b.PAIRS_STACK)
    first, targets = load64(block, b.PAIRS_FIRST), load64(block, b.PAIRS_TARGETS)
    start, found = load64(block, b.PAIRS_NEXT), load64(block, b.PAIRS_FOUND)
    end = min(start + b.PAIRS_PORTION, load64(block, b.PAIRS_NODES))
    for root in range(start, end):
        if load32(closed, root) == 0:
            continue
        store32(stack, 0, root)
        height = 1
        while height > 0:
            height -= 1
            node = load32(stack, height)
            for e in range(load64(first, node), load64(first, node + 1)):
                target = load32(targets, e)
                if load32(stamps, target) != root + 1:
                    store32(stamps, target, root + 1)
                    if load32(closed, target) != 0:
                        found += 1
                    else:
                        store32(stack, height, target)
                        height += 1
    store64(block, b.PAIRS_NEXT, end)
    store64(block, b.PAIRS_FOUND, found)
    return b.DONE if end == load64(block, b.PAIRS_NODES) else b.PORTION
