"""Breadth-first exploration: expand a batch of nodes by the compiled step program, then look all successors up.

The step program writes the successors of a batch into a buffer that stays in the cache; all their hash values are
computed and all table slots asked for before the first is looked up, so that the waits for memory overlap.
"""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels.sets import enter, foresee, hashed, insert
from llfsm_verify.kripke.kernels.words import (
    expand,
    helper,
    kernel,
    load8,
    load32,
    load64,
    prefetch,
    shifted,
    store32,
    store64,
)


@helper
def begin_batch(block: int, words: int) -> None:
    """Copy the next nodes, as records, to where the step program reads them."""
    start = load64(block, b.EXPANDED)
    count = min(
        min(load64(block, b.STOP), load64(load64(block, b.NODES), b.SET_COUNT)) - start, load64(block, b.BATCH_CAPACITY)
    )
    keys, batch, fresh = load64(load64(block, b.NODES), b.SET_KEYS), load64(block, b.BATCH), load64(block, b.FRESH)
    record = load64(block, b.RECORD)
    for n in range(count):
        for i in range(words):
            store64(batch, n * record + i, load64(keys, (start + n) * words + i))
        for i in range(words, record):
            store64(batch, n * record + i, load64(fresh, i - words))
    store64(block, b.BATCH_COUNT, count)
    context, index = load64(block, b.CONTEXT), load64(block, b.CONTEXT_SOURCE)
    store64(context, index, 0)


@helper
def label_of(block: int, outputs: int, edge: int) -> int:
    """The number of the letter that the output words show; -1 when there is no room for a new one.

    `edge` is the one from the node whose step shows it, or whose chain does.
    """
    letters, words = load64(block, b.LETTERS), load64(block, b.RECORD) - load64(block, b.CONFIGURATION)
    mask, key, last = load64(block, b.LETTER_MASK), load64(block, b.LETTER_KEY), load64(block, b.LAST_KEY)
    same = load64(block, b.LAST_LABEL) >= 0
    for i in range(words):
        value = load64(outputs, i) & load64(mask, i)
        store64(key, i, value)
        same = same and value == load64(last, i)
    if same:
        return load64(block, b.LAST_LABEL)
    if load64(letters, b.SET_COUNT) >= load64(letters, b.SET_LIMIT):
        return -1
    known = load64(letters, b.SET_COUNT)
    label = insert(letters, key, hashed(key, words), words)
    if label == known:
        store32(load64(block, b.LETTER_SOURCES), label, load64(block, b.EXPANDED) + load32(edge, b.EDGE_SOURCE))
    for i in range(words):
        store64(last, i, load64(key, i))
    store64(block, b.LAST_LABEL, label)
    return label


@helper
def hashed_number(number: int) -> int:
    h = (number ^ shifted(number, 33)) * -49064778989728563
    return h ^ shifted(h, 29)


@helper
def enter_pair(table: int, mask: int, generation: int, pair: int) -> bool:
    """Enter a pair into the group table; whether it is new. Entries of other generations count as free."""
    i = hashed_number(pair) & mask
    while load64(table, 2 * i) == generation:
        if load64(table, 2 * i + 1) == pair:
            return False
        i = (i + 1) & mask
    store64(table, 2 * i, generation)
    store64(table, 2 * i + 1, pair)
    return True


@helper
def enter_group(block: int, target: int, label: int) -> bool:
    table, mask = load64(block, b.GROUP_TABLE), load64(block, b.GROUP_MASK)
    return enter_pair(table, mask, load64(block, b.GENERATION), target | label << 32)


@kernel("regroup")
def regroup(block: int) -> int:
    """Move the entries of the current generation from one group table to a larger one."""
    old, generation = load64(block, b.REGROUP_OLD), load64(block, b.REGROUP_GENERATION)
    for i in range(load64(block, b.REGROUP_OLD_SLOTS)):
        if load64(old, 2 * i) == generation:
            enter_pair(
                load64(block, b.REGROUP_TABLE), load64(block, b.REGROUP_MASK), generation, load64(old, 2 * i + 1)
            )
    return b.DONE


@helper
def is_new(block: int, target: int, label: int) -> int:
    """Whether a pair is new among the successors of this node: bit 0; and whether its target is: bit 1."""
    count, small = load64(block, b.GROUP_COUNT), load64(block, b.GROUP_FIRST)
    if count < b.SMALL_GROUP:
        answer = 2
        for i in range(count):
            if load32(small, 2 * i) == target:
                if load32(small, 2 * i + 1) == label:
                    return 0
                answer = 0
        store32(small, 2 * count, target)
        store32(small, 2 * count + 1, label)
        store64(block, b.GROUP_COUNT, count + 1)
        return answer | 1
    if count == b.SMALL_GROUP:
        for i in range(count):
            enter_group(block, load32(small, 2 * i), load32(small, 2 * i + 1))
            enter_group(block, load32(small, 2 * i), b.NO_LABEL)
    if label != b.NO_LABEL and not enter_group(block, target, label):
        return 0
    fresh = enter_group(block, target, b.NO_LABEL)
    if label == b.NO_LABEL and not fresh:
        return 0
    store64(block, b.GROUP_COUNT, count + 1)
    return 3 if fresh else 1


@helper
def ends_cycle(block: int, edge: int, body: int) -> bool:
    """Whether a step completed a cycle, or was the stutter of an arrangement that has ended."""
    closed = shifted(load64(body, load64(block, b.CYCLE_WORD)), load64(block, b.CYCLE_BIT)) & 1
    return closed != 0 or load32(edge, b.EDGE_PROCESS) == b.STUTTER


@helper
def stay(_block: int, _words: int, _edge: int, _body: int, label: int) -> int:
    return label


def exploration(
    fixed: int, whole_cycles: bool, follow: Callable[[int, int, int, int, int], int] = stay
) -> Callable[[int], int]:
    """The kernel for nodes of `fixed` words (0: any number), with a letter for each step or for whole cycles.

    `follow` may go on from an edge to a later configuration; it gives the label of all steps (`kernels.chains`).
    """
    follows = follow is not stay

    @helper
    def prepare(block: int, words: int) -> bool:
        """Labels and hash values of the edges in the buffer; false when there is no room for a letter."""
        edges, edge_bytes, body_at = load64(block, b.EDGES), load64(block, b.EDGE_BYTES), load64(block, b.EDGE_BODY)
        configuration, fresh = load64(block, b.CONFIGURATION), load64(block, b.FRESH)
        hashes, labels = load64(block, b.EDGE_HASHES), load64(block, b.EDGE_LABELS)
        labelled = whole_cycles or follows or load64(block, b.WITH_LETTERS) != 0
        outputs, mask, last = (
            load64(block, b.RECORD) - configuration, load64(block, b.LETTER_MASK), load64(block, b.LAST_KEY)
        )  # fmt: skip
        last_label = load64(block, b.LAST_LABEL)
        for n in range(load64(block, b.EDGES_READY), load64(block, b.EDGES_COUNT)):
            edge = edges + n * edge_bytes
            body = edge + body_at
            if load32(edge, b.EDGE_STATUS) == 0:
                label = b.NO_LABEL
                if labelled and (not whole_cycles or ends_cycle(block, edge, body)):
                    letter = body + configuration * 8
                    same = last_label >= 0
                    for i in range(outputs):
                        same = same and load64(letter, i) & load64(mask, i) == load64(last, i)
                    if not same:
                        last_label = label_of(block, letter, edge)
                    label = last_label
                    if label >= 0 and follows:
                        label = follow(block, words, edge, body, label)
                        last_label = load64(block, b.LAST_LABEL)
                    if label < 0:
                        store64(block, b.EDGES_READY, n)
                        return False
                    if whole_cycles:
                        for i in range(configuration, words):
                            store64(body, i, load64(fresh, i - configuration))
                store64(labels, n, label)
                store64(hashes, n, hashed(body, words))
        store64(block, b.EDGES_READY, load64(block, b.EDGES_COUNT))
        return True

    @helper
    def look_up(block: int, words: int) -> int:
        """Enter the prepared edges; b.BROKEN when the step program contradicted itself.

        What is needed for each edge is held in locals: after a store the compiler would load it from memory again.
        """
        nodes, with_edges = load64(block, b.NODES), load64(block, b.WITH_EDGES) != 0
        table, mask, shift = load64(nodes, b.SET_TABLE), load64(nodes, b.SET_MASK), load64(nodes, b.SET_SHIFT)
        keys, known = load64(nodes, b.SET_KEYS), load64(nodes, b.SET_COUNT)
        edges, edge_bytes, body_at = load64(block, b.EDGES), load64(block, b.EDGE_BYTES), load64(block, b.EDGE_BODY)
        hashes, labels, slots = (
            load64(block, b.EDGE_HASHES), load64(block, b.EDGE_LABELS), load64(block, b.EDGE_SLOTS)
        )  # fmt: skip
        done, count = load64(block, b.EDGES_DONE), load64(block, b.EDGES_COUNT)
        base, parents = load64(block, b.EXPANDED), load64(block, b.PARENTS)
        first, edge_targets, edge_labels = load64(block, b.FIRST), load64(block, b.TARGETS), load64(block, b.LABELS)
        kept, edge_sources = load64(block, b.KEPT), load64(block, b.SOURCES)
        current, steps, at = load64(block, b.SOURCE), load64(block, b.SOURCE_EDGES), load64(block, b.EDGE_COUNT)
        small, grouped, generation = (
            load64(block, b.GROUP_FIRST), load64(block, b.GROUP_COUNT), load64(block, b.GENERATION)
        )  # fmt: skip
        level_end, depth = load64(block, b.LEVEL_END), load64(block, b.DEPTH)
        configurations, transitions = load64(block, b.CONFIGURATIONS), load64(block, b.TRANSITIONS)
        result = b.DONE
        for n in range(done, count):
            prefetch(table + shifted(load64(hashes, n), shift) * 8)
        for n in range(done, count):
            h = load64(hashes, n)
            store64(slots, n, foresee(table, mask, shifted(h, shift), keys, h, words))
        for n in range(done, count):
            edge = edges + n * edge_bytes
            source = base + load32(edge, b.EDGE_SOURCE)
            if source != current:  # nodes between the last source and this one have no successors
                if with_edges and kept == 0:
                    for between in range(current + 1, source + 1):
                        store64(first, between, at)
                current, steps, grouped = source, 0, 0
                generation += 1
                if source >= level_end:
                    level_end = known
                    depth += 1
            steps += 1
            status = load32(edge, b.EDGE_STATUS)
            if status != 0:
                if status == load64(block, b.BROKEN_STATUS):
                    result = b.BROKEN
                elif status == load64(block, b.OVERFLOW_STATUS):
                    if load64(block, b.OVERFLOW) < 0:
                        store64(block, b.OVERFLOW, source)
                elif load64(load64(block, b.FAULTS), status - 1) < 0:
                    store64(load64(block, b.FAULTS), status - 1, source)
                continue
            label = load64(labels, n)
            h = load64(hashes, n)
            target = enter(table, mask, shifted(h, shift), load64(slots, n), keys, known, edge + body_at, h, words)
            if target == known:
                known += 1
                store32(parents, target, source)
                if not whole_cycles or label != b.NO_LABEL:
                    configurations += 1
            new = 3
            if grouped < b.SMALL_GROUP:
                for i in range(grouped):
                    if load32(small, 2 * i) == target:
                        if load32(small, 2 * i + 1) == label:
                            new = 0
                            break
                        new = 1
                if new != 0:
                    store32(small, 2 * grouped, target)
                    store32(small, 2 * grouped + 1, label)
                    grouped += 1
            else:
                store64(block, b.GROUP_COUNT, grouped)
                store64(block, b.GENERATION, generation)
                new = is_new(block, target, label)
                grouped = load64(block, b.GROUP_COUNT)
            if new & 2:
                transitions += 1
            if with_edges and new & 1 and (kept == 0 or load8(kept, label) != 0):
                if kept != 0:
                    store32(edge_sources, at, source)
                store32(edge_targets, at, target)
                store32(edge_labels, at, label)
                at += 1
        store64(nodes, b.SET_COUNT, known)
        store64(block, b.SOURCE, current)
        store64(block, b.SOURCE_EDGES, steps)
        store64(block, b.EDGE_COUNT, at)
        store64(block, b.GROUP_COUNT, grouped)
        store64(block, b.GENERATION, generation)
        store64(block, b.LEVEL_END, level_end)
        store64(block, b.DEPTH, depth)
        store64(block, b.CONFIGURATIONS, configurations)
        store64(block, b.TRANSITIONS, transitions)
        store64(block, b.EDGES_DONE, count)
        return result

    def explore(block: int) -> int:
        words = fixed or load64(block, b.WORDS)
        nodes, with_edges = load64(block, b.NODES), load64(block, b.WITH_EDGES) != 0
        context, source_at = load64(block, b.CONTEXT), load64(block, b.CONTEXT_SOURCE)
        end, narrow = load64(block, b.SEEN_EDGES) + load64(block, b.PORTION_EDGES), load64(block, b.KEPT) != 0
        while True:
            if load64(block, b.EDGES_DONE) == load64(block, b.EDGES_COUNT):
                batch = load64(block, b.BATCH_COUNT)
                if batch > 0 and load64(context, source_at) >= batch:
                    expanded = load64(block, b.EXPANDED) + batch
                    store64(block, b.EXPANDED, expanded)
                    store64(block, b.BATCH_COUNT, 0)
                    batch = 0
                    if with_edges and not narrow:
                        store64(load64(block, b.FIRST), expanded, load64(block, b.EDGE_COUNT))
                found = load64(nodes, b.SET_COUNT)
                if found >= load64(block, b.FOUND_STOP):
                    return b.DONE
                if batch == 0 and load64(block, b.EXPANDED) >= min(load64(block, b.STOP), found):
                    return b.DONE
                if batch == 0 and load64(block, b.SETTLE) != 0:
                    return b.DONE
                if load64(block, b.SEEN_EDGES) >= end:
                    return b.PORTION
                if batch == 0:
                    begin_batch(block, words)
                records, edges = load64(block, b.BATCH), load64(block, b.EDGES)
                count = expand(
                    load64(block, b.EXPAND),
                    records,
                    load64(block, b.BATCH_COUNT),
                    edges,
                    load64(block, b.EDGES_CAPACITY),
                    context,
                )
                store64(block, b.EDGES_COUNT, count)
                store64(block, b.EDGES_READY, 0)
                store64(block, b.EDGES_DONE, 0)
                store64(block, b.SEEN_EDGES, load64(block, b.SEEN_EDGES) + count)
            if not prepare(block, words):
                return b.ROOM_LETTERS
            if narrow and load64(load64(block, b.LETTERS), b.SET_COUNT) > load64(block, b.KEPT_LETTERS):
                return b.ROOM_LETTERS
            rest = load64(block, b.EDGES_COUNT) - load64(block, b.EDGES_DONE)
            if load64(nodes, b.SET_COUNT) + rest > load64(nodes, b.SET_LIMIT):
                return b.ROOM_NODES
            if with_edges and load64(block, b.EDGE_COUNT) + rest > load64(block, b.EDGE_LIMIT):
                return b.ROOM_EDGES
            if load64(block, b.GROUP_COUNT) + rest > load64(block, b.GROUP_LIMIT):
                return b.ROOM_GROUP
            if look_up(block, words) == b.BROKEN:
                return b.BROKEN
            if load64(block, b.SOURCE_EDGES) > b.MAX_STEPS:
                return b.PORTION

    return explore


kernel("explore_1")(exploration(1, False))
kernel("explore_2")(exploration(2, False))
kernel("explore_any")(exploration(0, False))
kernel("explore_cycles")(exploration(0, True))
