"""How many configurations the chains of a graph pass, and how many direct successors its nodes have.

From every direct successor of a node a walk goes on to the next node, or to a configuration that has been passed
before. Several walks go on in turn: the places where the next configuration of each is looked up are asked for before
the others take their step.
"""

from __future__ import annotations

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels import chain_blocks as c
from llfsm_verify.kripke.kernels.chains import copy, only_step
from llfsm_verify.kripke.kernels.exploration import is_new
from llfsm_verify.kripke.kernels.sets import LOW, ask, equal, following, hashed, insert
from llfsm_verify.kripke.kernels.words import expand, helper, kernel, load32, load64, shifted, store64


@helper
def is_stored(nodes: int, vector: int, h: int, words: int) -> int:
    """The number of a node; -1: the configuration is none."""
    table, mask, keys = load64(nodes, b.SET_TABLE), load64(nodes, b.SET_MASK), load64(nodes, b.SET_KEYS)
    i = first = shifted(h, load64(nodes, b.SET_SHIFT))
    while True:
        slot = load64(table, i)
        if slot == 0:
            return -1
        if (slot ^ h) & ~LOW == 0:
            number = (slot & LOW) - 1
            if equal(keys + number * words * 8, vector, words):
                return number
        i = following(i, first, mask)


@helper
def is_mine(chain: int, h: int) -> bool:
    """Whether a configuration is of the class that is counted."""
    return shifted(h, c.CLASS_SHIFT) & (load64(chain, c.CLASSES) - 1) == load64(chain, c.CLASS)


@helper
def go_on(block: int, chain: int, configuration: int, walker: int, words: int) -> bool:
    """Take a walk from a configuration to its only successor; false: the step program contradicts itself."""
    successor = load64(chain, c.STEPS) + load64(block, b.EDGE_BODY)
    copy(configuration, load64(chain, c.CURRENT), words)
    if not only_step(block, chain):
        return False
    h = hashed(successor, words)
    store64(walker, 0, h)
    copy(successor, walker + 8, words)
    ask(load64(block, b.NODES), h)
    ask(load64(chain, c.INTERIOR), h)
    return True


@helper
def is_over(block: int, chain: int, walker: int, words: int) -> bool:
    """Whether a walk has come to a node or to what has been passed before; else its configuration is entered."""
    interior, h = load64(chain, c.INTERIOR), load64(walker, 0)
    if is_stored(load64(block, b.NODES), walker + 8, h, words) >= 0:
        return True
    if not is_mine(chain, h):
        return False
    known = load64(interior, b.SET_COUNT)
    return insert(interior, walker + 8, h, words) != known


@helper
def walk(block: int, words: int) -> int:
    """Go on with all walks until none is left (DONE), a portion is done, or there is no room (ROOM_NODES)."""
    chain = load64(block, b.CHAINS)
    interior, walkers, queue = load64(chain, c.INTERIOR), load64(chain, c.WALKERS), load64(chain, c.QUEUE)
    edges, edge_bytes, body_at = load64(block, b.EDGES), load64(block, b.EDGE_BYTES), load64(block, b.EDGE_BODY)
    size = (words + 1) * 8
    active, begun, due = load64(chain, c.ACTIVE), load64(chain, c.QUEUE_DONE), load64(chain, c.QUEUE_COUNT)
    left = load64(block, b.PORTION_EDGES)
    code = b.PORTION
    while left > 0:
        while active < c.MOST_WALKERS and begun < due:
            body = edges + load64(queue, begun) * edge_bytes + body_at
            if not go_on(block, chain, body, walkers + active * size, words):
                return b.BROKEN
            begun += 1
            active += 1
        if active == 0:
            code = b.DONE
            break
        if load64(interior, b.SET_COUNT) + active > load64(interior, b.SET_LIMIT):
            code = b.ROOM_NODES
            break
        left -= active
        i = 0
        while i < active:
            walker = walkers + i * size
            if is_over(block, chain, walker, words):
                active -= 1
                copy(walkers + active * size, walker, words + 1)
            else:
                if not go_on(block, chain, walker + 8, walker, words):
                    return b.BROKEN
                i += 1
    store64(chain, c.ACTIVE, active)
    store64(chain, c.QUEUE_DONE, begun)
    return code


@helper
def enter_successors(block: int, words: int) -> None:
    """Count the distinct direct successors in the buffer that are of this class; walks from the new ones are due."""
    chain, nodes = load64(block, b.CHAINS), load64(block, b.NODES)
    interior, queue = load64(chain, c.INTERIOR), load64(chain, c.QUEUE)
    edges, edge_bytes, body_at = load64(block, b.EDGES), load64(block, b.EDGE_BYTES), load64(block, b.EDGE_BODY)
    hashes, count = load64(block, b.EDGE_HASHES), load64(block, b.EDGES_COUNT)
    for n in range(count):
        h = hashed(edges + n * edge_bytes + body_at, words)
        store64(hashes, n, h)
        ask(nodes, h)
        ask(interior, h)
    due = 0
    for n in range(count):
        edge, h = edges + n * edge_bytes, load64(hashes, n)
        source = load64(chain, c.NEXT) + load32(edge, b.EDGE_SOURCE)
        if source != load64(chain, c.SOURCE):
            store64(chain, c.SOURCE, source)
            store64(block, b.GROUP_COUNT, 0)
            store64(block, b.GENERATION, load64(block, b.GENERATION) + 1)
        if load32(edge, b.EDGE_STATUS) != 0:
            continue
        number = is_stored(nodes, edge + body_at, h, words)
        is_due = number < 0
        if is_mine(chain, h):
            kind = 0
            if number < 0:
                known = load64(interior, b.SET_COUNT)
                number, kind = insert(interior, edge + body_at, h, words), 1
                is_due = number == known
            store64(chain, c.SUCCESSORS, load64(chain, c.SUCCESSORS) + (is_new(block, number, kind) & 1))
        if is_due:
            store64(queue, due, n)
            due += 1
    store64(chain, c.QUEUE_COUNT, due)
    store64(chain, c.QUEUE_DONE, 0)
    store64(block, b.EDGES_DONE, count)


@helper
def expand_more(block: int, words: int) -> bool:
    """Put the steps of the next nodes into the buffer; false when there are no more."""
    chain, nodes, batch = load64(block, b.CHAINS), load64(block, b.NODES), load64(block, b.BATCH)
    context, source_at = load64(block, b.CONTEXT), load64(block, b.CONTEXT_SOURCE)
    keys, fresh, record = load64(nodes, b.SET_KEYS), load64(block, b.FRESH), load64(block, b.RECORD)
    if load64(context, source_at) >= load64(block, b.BATCH_COUNT):
        start = load64(chain, c.NEXT) + load64(block, b.BATCH_COUNT)
        count = min(load64(chain, c.END) - start, load64(block, b.BATCH_CAPACITY))
        store64(chain, c.NEXT, start)
        store64(block, b.BATCH_COUNT, count)
        if count == 0:
            return False
        for n in range(count):
            copy(keys + (start + n) * words * 8, batch + n * record * 8, words)
            copy(fresh, batch + (n * record + words) * 8, record - words)
        store64(context, source_at, 0)
    count = expand(
        load64(block, b.EXPAND),
        batch,
        load64(block, b.BATCH_COUNT),
        load64(block, b.EDGES),
        load64(block, b.EDGES_CAPACITY),
        context,
    )
    store64(block, b.EDGES_COUNT, count)
    store64(block, b.EDGES_DONE, 0)
    return True


@kernel("count_chains")
def count_chains(block: int) -> int:
    """Go on with the count of one class: its configurations between nodes, and the steps of nodes that lead into it."""
    chain, words = load64(block, b.CHAINS), load64(block, b.WORDS)
    interior = load64(chain, c.INTERIOR)
    left = load64(block, b.PORTION_EDGES)
    while left > 0:
        count = load64(block, b.EDGES_COUNT)
        if load64(block, b.EDGES_DONE) < count:
            if load64(interior, b.SET_COUNT) + count > load64(interior, b.SET_LIMIT):
                return b.ROOM_NODES
            if load64(block, b.GROUP_COUNT) + count > load64(block, b.GROUP_LIMIT):
                return b.ROOM_GROUP
            enter_successors(block, words)
        known = load64(interior, b.SET_COUNT)
        code = walk(block, words)
        if code != b.DONE:
            return code
        left -= count + load64(interior, b.SET_COUNT) - known
        if not expand_more(block, words):
            return b.DONE
    return b.PORTION
