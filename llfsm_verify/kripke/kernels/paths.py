"""Shortest paths in the product, counted in letters: breadth first, layer by layer.

Where edges show no letter, a layer is first completed along these, then left along the others, so that a product node
gets its distance when it is found (a 0-1 breadth-first search without a second queue).
"""

from __future__ import annotations

from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.kernels.product_store import is_accepting, look_up
from llfsm_verify.kripke.kernels.words import kernel, load32, load64, store32, store64


@kernel("product_start")
def start(block: int) -> int:
    """Begin at STARTS, those not found yet, when all that was begun before is done. There must be room."""
    bits, slots, shift, queue = (
        load64(block, p.MARKS),
        load64(block, p.SLOTS),
        load64(block, p.SHIFT),
        load64(block, p.KEYS),
    )
    starts, nodes, parents = (load64(block, p.STARTS), load64(block, p.NODES), load64(block, p.PARENTS))
    count = load64(block, p.COUNT)
    store64(block, p.LAYER, count)
    store64(block, p.POSITION, count)
    for i in range(load64(block, p.START_COUNT)):
        key = load64(starts, i)
        if slots == 0:
            at = (key >> 32) * nodes + (key & p.NODE)
            bit = 1 << (at & 63)
            at = at >> 6
            if load64(bits, at) & bit != 0:
                continue
            store64(bits, at, load64(bits, at) | bit)
        else:
            at = look_up(slots, shift, queue, key)
            if at >= 0:
                continue
            store32(slots, -1 - at, count + 1)
        store64(queue, count, key)
        store32(parents, count, count)
        count += 1
    store64(block, p.COUNT, count)
    store64(block, p.LAYER_END, count)
    store64(block, p.CHECK_END, count)
    store64(block, p.SILENT, load64(block, p.EPSILONS))
    store64(block, p.DEPTH, 0)
    store64(block, p.BEGUN, 0)
    return p.DONE


@kernel("product_breadth")
def breadth(block: int) -> int:
    """Go on with the search. FOUND: a goal, nearest first, each once; HIT says which."""
    first, targets, labels = (load64(block, p.FIRST), load64(block, p.TARGETS), load64(block, p.LABELS))
    expanded, nodes = load64(block, p.EXPANDED), load64(block, p.NODES)
    classes, stride = load64(block, p.CLASSES), load64(block, p.STRIDE)
    rows, moves = load64(block, p.ROWS), load64(block, p.MOVES)
    bits, slots, shift, queue = (
        load64(block, p.MARKS),
        load64(block, p.SLOTS),
        load64(block, p.SHIFT),
        load64(block, p.KEYS),
    )
    count, capacity = load64(block, p.COUNT), load64(block, p.CAPACITY)
    queue_capacity, parents = load64(block, p.QUEUE_CAPACITY), load64(block, p.PARENTS)
    position, edge, move = (load64(block, p.POSITION), load64(block, p.EDGE), load64(block, p.MOVE))
    begun = load64(block, p.BEGUN)
    layer, layer_end, silent = (load64(block, p.LAYER), load64(block, p.LAYER_END), load64(block, p.SILENT))
    epsilons, depth, depth_limit = (load64(block, p.EPSILONS), load64(block, p.DEPTH), load64(block, p.DEPTH_LIMIT))
    goal, wanted, within = (load64(block, p.GOAL), load64(block, p.WANTED), load64(block, p.WITHIN))
    checked, check_end = load64(block, p.CHECKED), load64(block, p.CHECK_END)
    left = load64(block, p.WORK)
    budget = left
    code = p.PORTION

    state, last = 0, 0
    if begun != 0:
        key = load64(queue, position)
        state, node = key >> 32, key & p.NODE
        last = load64(first, node + 1) if node < expanded else edge
    while left > 0:
        if checked < check_end:
            checked += 1
            if goal == p.MARKED and is_accepting(block, load64(queue, checked - 1)):
                store64(block, p.HIT, checked - 1)
                store64(block, p.HIT_DEPTH, 0)
                code = p.FOUND
                break
            continue
        if begun == 0:
            if position == (count if silent != 0 else layer_end):
                if silent != 0:
                    layer_end = count
                    silent = 0
                    position = layer
                    continue
                if layer_end == count or depth == depth_limit:
                    code = p.DONE
                    break
                depth += 1
                layer = layer_end
                layer_end = count
                silent = epsilons
                continue
            key = load64(queue, position)
            state, node = key >> 32, key & p.NODE
            edge, last, move = 0, 0, 0
            if node < expanded:
                edge, last = load64(first, node), load64(first, node + 1)
            begun = 1
            left -= 1
        if edge == last:
            begun = 0
            position += 1
            continue
        label = load32(labels, edge)
        if epsilons != 0 and (label == p.EPSILON) != (silent != 0):
            edge += 1
            left -= 1
            continue
        letter = stride - 1 if label == p.EPSILON else load32(classes, label)
        row = load32(rows, state * stride + letter)
        if row == 0:
            store64(block, p.NEED_STATE, state)
            store64(block, p.NEED_CLASS, letter)
            code = p.NEED
            break
        if move >= load64(moves, row):
            edge += 1
            move = 0
            left -= 1
            continue
        key = load64(moves, row + 1 + 2 * move) << 32 | load32(targets, edge)
        # Is it new?
        at, bit = 0, 0
        if slots == 0:
            at = (key >> 32) * nodes + (key & p.NODE)
            bit = 1 << (at & 63)
            at = at >> 6
            if load64(bits, at) & bit != 0:
                move += 1
                continue
        else:
            at = look_up(slots, shift, queue, key)
            if at >= 0:
                move += 1
                continue
        if within != 0 and not is_accepting(block, key):
            move += 1
            continue
        if count == queue_capacity or (slots != 0 and count == capacity):
            code = p.GROW
            break
        if slots == 0:
            store64(bits, at, load64(bits, at) | bit)
        else:
            store32(slots, -1 - at, count + 1)
        store64(queue, count, key)
        store32(parents, count, position)
        count += 1
        flags = load64(moves, row + 2 + 2 * move)
        move += 1
        if (
            (goal == p.FLAGGED and flags != 0)
            or (goal == p.EXACTLY and key == wanted)
            or (goal == p.MARKED and is_accepting(block, key))
        ):
            store64(block, p.HIT, count - 1)
            store64(block, p.HIT_DEPTH, depth if silent != 0 else depth + 1)
            code = p.FOUND
            break

    store64(block, p.COUNT, count)
    store64(block, p.POSITION, position)
    store64(block, p.EDGE, edge)
    store64(block, p.MOVE, move)
    store64(block, p.BEGUN, begun)
    store64(block, p.LAYER, layer)
    store64(block, p.LAYER_END, layer_end)
    store64(block, p.SILENT, silent)
    store64(block, p.DEPTH, depth)
    store64(block, p.CHECKED, checked)
    store64(block, p.DONE_WORK, load64(block, p.DONE_WORK) + budget - left)
    return code


@kernel("product_edge")
def edge_between(block: int) -> int:
    """An edge of the graph that leads from one product node to another, if possible one without a letter; -1: none.

    Its rows of moves are there. Takes time for all edges of one node.
    """
    source, target = load64(block, p.EDGE_FROM), load64(block, p.EDGE_TO)
    first, targets, labels = (load64(block, p.FIRST), load64(block, p.TARGETS), load64(block, p.LABELS))
    classes, stride = load64(block, p.CLASSES), load64(block, p.STRIDE)
    rows, moves = load64(block, p.ROWS), load64(block, p.MOVES)
    state, node = source >> 32, source & p.NODE
    found = -1
    for edge in range(load64(first, node), load64(first, node + 1)):
        if load32(targets, edge) != target & p.NODE:
            continue
        label = load32(labels, edge)
        letter = stride - 1 if label == p.EPSILON else load32(classes, label)
        row = load32(rows, state * stride + letter)
        if row == 0:
            continue
        for move in range(load64(moves, row)):
            if load64(moves, row + 1 + 2 * move) == target >> 32 and (found < 0 or label == p.EPSILON):
                found = edge
    store64(block, p.EDGE_FOUND, found)
    return p.DONE


@kernel("product_silent")
def has_silent(block: int) -> int:
    """Whether there is an edge without a letter among those from ENTER_BEGIN to ENTER_END."""
    labels = load64(block, p.LABELS)
    found = 0
    for edge in range(load64(block, p.ENTER_BEGIN), load64(block, p.ENTER_END)):
        found |= load32(labels, edge) == p.EPSILON
    return found
