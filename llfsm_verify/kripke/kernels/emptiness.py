"""Is there an accepting run in the product? Strongly connected components on the fly, with generalised acceptance.

Couvreur, On-the-fly verification of linear temporal logic, FM 1999; Gabow, Path-based depth-first search for strong
and biconnected components, IPL 74 (2000). The search path and the components on it are explicit stacks.
"""

from __future__ import annotations

from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.kernels.product_store import look_up
from llfsm_verify.kripke.kernels.words import kernel, load32, load64, shifted, store32, store64


@kernel("product_components")
def components(block: int) -> int:
    """Go on with the search. FOUND: the topmost component of the path has edges of all acceptance sets inside."""
    first, targets, labels = (load64(block, p.FIRST), load64(block, p.TARGETS), load64(block, p.LABELS))
    expanded, nodes = load64(block, p.EXPANDED), load64(block, p.NODES)
    classes, stride = load64(block, p.CLASSES), load64(block, p.STRIDE)
    rows, moves = load64(block, p.ROWS), load64(block, p.MOVES)
    marks, slots, shift, keys = (
        load64(block, p.MARKS),
        load64(block, p.SLOTS),
        load64(block, p.SHIFT),
        load64(block, p.KEYS),
    )
    count, capacity = load64(block, p.COUNT), load64(block, p.CAPACITY)
    starts, start_count, started = (load64(block, p.STARTS), load64(block, p.START_COUNT), load64(block, p.STARTED))
    start_states = load64(block, p.START_STATES)
    active, top = load64(block, p.ACTIVE), load64(block, p.ACTIVE_COUNT)
    path, depth = load64(block, p.PATH), load64(block, p.PATH_COUNT)
    roots, root = load64(block, p.ROOTS), load64(block, p.ROOT_COUNT)
    stack_capacity, full = load64(block, p.STACK_CAPACITY), load64(block, p.FULL)
    closing, closing_mark = load64(block, p.CLOSING), load64(block, p.CLOSING_MARK)
    collecting, ending = load64(block, p.COLLECTING), load64(block, p.ENDING)
    left = load64(block, p.WORK)
    budget = left
    code = p.PORTION

    # The node at the end of the path.
    state, place, edge, last, move, row = 0, 0, 0, 0, 0, 0
    loaded = False
    while left > 0:
        if closing >= 0:
            if top > closing:
                top -= 1
                left -= 1
                key = load64(active, top)
                if slots == 0:
                    store32(marks, (key >> 32) * nodes + (key & p.NODE), closing_mark)
                else:
                    store32(marks, look_up(slots, shift, keys, key), closing_mark)
            else:
                closing = -1
            continue
        if ending != 0:
            if root == 0:
                depth = 0
                code = p.DONE
                break
            root -= 1
            closing = load64(roots, 3 * root)
            closing_mark = p.ACCEPTING if load64(roots, 3 * root + 2) == full else p.CLOSED
            continue

        # Which product node comes next, and with what acceptance is it entered?
        entered = 0
        if depth == 0:
            if started == start_count:
                code = p.DONE
                break
            key = load64(starts, started)
            if start_states != 0:
                state = load32(start_states, key >> 32)
                if state == p.NO_STATE:
                    started += 1
                    left -= 1
                    continue
                key = state << 32 | (key & p.NODE)
        else:
            if not loaded:
                word = load64(path, 2 * depth - 1)
                place = word & p.NODE
                edge, last, move = 0, shifted(word, 32), 0
                if last > 0:
                    state = load64(active, place) >> 32
                    word = load64(path, 2 * depth - 2)
                    edge, move = word >> p.MOVE_BITS, word & p.MOST_MOVES
                    last += edge
                loaded = True
            if edge == last:
                depth -= 1
                loaded = False
                if load64(roots, 3 * root - 3) == place:
                    root -= 1
                    closing = place
                    closing_mark = p.ACCEPTING if load64(roots, 3 * root + 2) == full else p.CLOSED
                continue
            label = load32(labels, edge)
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
            entered = load64(moves, row + 2 + 2 * move)

        if slots == 0:
            at = (key >> 32) * nodes + (key & p.NODE)
            mark = load32(marks, at)
        else:
            at = look_up(slots, shift, keys, key)
            mark = load32(marks, at) if at >= 0 else 0
        if mark == 0:
            if top == stack_capacity or (slots != 0 and count == capacity):
                code = p.GROW
                break
            if depth == 0:
                started += 1
            else:
                move += 1
                if move == load64(moves, row):
                    edge += 1
                    move = 0
                store64(path, 2 * depth - 2, edge << p.MOVE_BITS | move)
                store64(path, 2 * depth - 1, (last - edge) << 32 | place)
            if slots != 0:
                store32(slots, -1 - at, count + 1)
                store64(keys, count, key)
                at = count
            count += 1
            store32(marks, at, top + 1)
            store64(active, top, key)
            store64(roots, 3 * root, top)
            store64(roots, 3 * root + 1, entered)
            store64(roots, 3 * root + 2, 0)
            root += 1
            depth += 1
            state, node, place, move = key >> 32, key & p.NODE, top, 0
            top += 1
            edge, last = 0, 0
            if node < expanded:
                edge, last = load64(first, node), load64(first, node + 1)
            loaded = True
            left -= 1
            continue
        if depth == 0:
            started += 1
            left -= 1
            continue
        move += 1
        if mark < p.ACCEPTING:
            while load64(roots, 3 * root - 3) >= mark:
                root -= 1
                entered |= load64(roots, 3 * root + 1) | load64(roots, 3 * root + 2)
            entered |= p.INNER | load64(roots, 3 * root - 1)
            store64(roots, 3 * root - 1, entered)
            if entered == full and collecting == 0:
                code = p.FOUND
                break

    if loaded and depth > 0:
        store64(path, 2 * depth - 2, edge << p.MOVE_BITS | move)
        store64(path, 2 * depth - 1, (last - edge) << 32 | place)
    store64(block, p.COUNT, count)
    store64(block, p.STARTED, started)
    store64(block, p.ACTIVE_COUNT, top)
    store64(block, p.PATH_COUNT, depth)
    store64(block, p.ROOT_COUNT, root)
    store64(block, p.CLOSING, closing)
    store64(block, p.CLOSING_MARK, closing_mark)
    store64(block, p.DONE_WORK, load64(block, p.DONE_WORK) + budget - left)
    return code
