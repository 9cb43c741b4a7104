"""From which product nodes an accepting component can still be reached: sweeps over all that a search has found."""

from __future__ import annotations

from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.kernels.product_store import is_accepting, look_up
from llfsm_verify.kripke.kernels.words import helper, kernel, load32, load64, store64


@helper
def place_of(block: int, key: int) -> int:
    """Where the bit of a product node is."""
    slots = load64(block, p.SLOTS)
    if slots == 0:
        return (key >> 32) * load64(block, p.NODES) + (key & p.NODE)
    return look_up(slots, load64(block, p.SHIFT), load64(block, p.KEYS), key)


@helper
def is_set(bits: int, place: int) -> bool:
    return load64(bits, place >> 6) & (1 << (place & 63)) != 0


@kernel("product_live")
def sweep(block: int) -> int:
    """Go on with a sweep, from the product node found last to the first: live are those in accepting components, and
    those with a move to a live one. DONE: the sweep is over, and LEARNT tells whether there may be more.

    The search that found them has ended, so each row of moves is there.
    """
    first, targets, labels = (load64(block, p.FIRST), load64(block, p.TARGETS), load64(block, p.LABELS))
    expanded, classes, stride = load64(block, p.EXPANDED), load64(block, p.CLASSES), load64(block, p.STRIDE)
    rows, moves, keys = load64(block, p.ROWS), load64(block, p.MOVES), load64(block, p.KEYS)
    bits, position, learnt = load64(block, p.LIVE), load64(block, p.LEFT), load64(block, p.LEARNT)
    left = load64(block, p.WORK)
    budget = left
    code = p.PORTION
    while left > 0:
        if position == 0:
            code = p.DONE
            break
        position -= 1
        left -= 1
        key = load64(keys, position)
        place = place_of(block, key)
        if is_set(bits, place):
            continue
        live = is_accepting(block, key)
        state, node = key >> 32, key & p.NODE
        edge, last = 0, 0
        if not live and node < expanded:
            edge, last = load64(first, node), load64(first, node + 1)
        while edge < last and not live:
            label = load32(labels, edge)
            letter = stride - 1 if label == p.EPSILON else load32(classes, label)
            row = load32(rows, state * stride + letter)
            move, count = 0, load64(moves, row)
            while move < count and not live:
                target = load64(moves, row + 1 + 2 * move) << 32 | load32(targets, edge)
                live = is_set(bits, place_of(block, target))
                move += 1
            edge += 1
            left -= 1
        if live:
            store64(bits, place >> 6, load64(bits, place >> 6) | 1 << (place & 63))
            learnt = 1
    store64(block, p.LEFT, position)
    store64(block, p.LEARNT, learnt)
    store64(block, p.DONE_WORK, load64(block, p.DONE_WORK) + budget - left)
    return code


@kernel("product_lost")
def lost(block: int) -> int:
    """FOUND: HIT is the first product node from POSITION on that is not live, with a state that is WATCHED."""
    bits, watched, keys = load64(block, p.LIVE), load64(block, p.WATCHED), load64(block, p.KEYS)
    position, count, left = load64(block, p.POSITION), load64(block, p.COUNT), load64(block, p.WORK)
    budget = left
    code = p.PORTION
    while left > 0:
        if position == count:
            code = p.DONE
            break
        key = load64(keys, position)
        position += 1
        left -= 1
        if load32(watched, key >> 32) != 0 and not is_set(bits, place_of(block, key)):
            store64(block, p.HIT, position - 1)
            code = p.FOUND
            break
    store64(block, p.POSITION, position)
    store64(block, p.DONE_WORK, load64(block, p.DONE_WORK) + budget - left)
    return code
