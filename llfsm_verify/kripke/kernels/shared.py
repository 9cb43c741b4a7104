"""Exploration by several threads: a chunk of nodes that are known is expanded by tasks, with the numbers of one thread.

New nodes are entered into the table of all at once, by compare and swap, with a number that tells their place: task and
entry. Of equal nodes the one with the least place stays (a minimum, whoever comes first). When all tasks are done, the
entries that stayed are counted, and get the numbers that one thread would have given: in the order of source and draw.
Then nothing depends on which thread did what. A chunk that meets something rare (a new letter, no room) is undone: all
slots of places become free again, and one thread does it.
"""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels import shared_blocks as s
from llfsm_verify.kripke.kernels.exploration import ends_cycle
from llfsm_verify.kripke.kernels.sets import LOW, equal, following, hashed
from llfsm_verify.kripke.kernels.words import (
    acquired,
    added,
    exchanged,
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
def wait(thread: int) -> None:
    """Nothing, or in tests now and then a while."""
    if load64(load64(thread, s.SHARED), s.DELAY) != 0:
        state = load64(thread, s.RANDOM) * 6364136223846793005 + 1442695040888963407
        store64(thread, s.RANDOM, state)
        drawn = shifted(state, 48)
        if drawn & 63 == 0:
            for _ in range(drawn):
                acquired(thread, s.RANDOM)


@helper
def fail(shared: int, reason: int) -> None:
    exchanged(shared, s.FAILED, 0, reason)


@helper
def known_label(block: int, thread: int, outputs: int) -> int:
    """The number of the letter that the output words show; -1: it has none yet."""
    letters, words = load64(block, b.LETTERS), load64(block, b.RECORD) - load64(block, b.CONFIGURATION)
    mask, key, last = load64(block, b.LETTER_MASK), load64(thread, s.KEY), load64(thread, s.LAST_KEY)
    for i in range(words):
        store64(key, i, load64(outputs, i) & load64(mask, i))
    h = hashed(key, words)
    table, slots, keys = load64(letters, b.SET_TABLE), load64(letters, b.SET_MASK), load64(letters, b.SET_KEYS)
    i = first = shifted(h, load64(letters, b.SET_SHIFT))
    while True:
        slot = load64(table, i)
        if slot == 0:
            return -1
        if (slot ^ h) & ~LOW == 0 and equal(keys + ((slot & LOW) - 1) * words * 8, key, words):
            break
        i = following(i, first, slots)
    label = (slot & LOW) - 1
    for i in range(words):
        store64(last, i, load64(key, i))
    store64(thread, s.LAST_LABEL, label)
    return label


@helper
def note_fault(block: int, thread: int, status: int, source: int) -> None:
    table = load64(thread, s.FAULTS)
    fault = 0 if status == load64(block, b.OVERFLOW_STATUS) else status
    store64(thread, s.FAULTED, 1)
    if load64(table, fault) < 0 or source < load64(table, fault):
        store64(table, fault, source)


@helper
def enter_group(table: int, generation: int, entry: int, h: int) -> None:
    i = h & (s.GROUP_SLOTS - 1)
    while shifted(load64(table, i), s.POSITION_BITS) == generation:
        i = (i + 1) & (s.GROUP_SLOTS - 1)
    store64(table, i, generation << s.POSITION_BITS | entry)


@helper
def met_in_group(thread: int, group: int, size: int, words: int, vector: int, h: int, label: int) -> int:
    """2 when this successor came already with this label, 1 when it came with others, 0 when it is new; then, and with
    1, it is entered into the table of a large group, of which `size` have come."""
    table, stride = load64(thread, s.GROUP), (words + s.ENTRY_WORDS) * 8
    if size == b.SMALL_GROUP:
        store64(thread, s.GENERATION, load64(thread, s.GENERATION) + 1)
        for n in range(size):
            enter_group(table, load64(thread, s.GENERATION), n, load64(group + n * stride, words + s.HASH))
    generation, found = load64(thread, s.GENERATION), 0
    i = h & (s.GROUP_SLOTS - 1)
    while True:
        slot = load64(table, i)
        if shifted(slot, s.POSITION_BITS) != generation:
            break
        entry = group + (slot & ((1 << s.POSITION_BITS) - 1)) * stride
        if equal(entry, vector, words):
            found = 1
            if shifted(load64(entry, words + s.LABEL), 32) == label:
                return 2
        i = (i + 1) & (s.GROUP_SLOTS - 1)
    store64(table, i, generation << s.POSITION_BITS | size)
    return found


@helper
def foresee_shared(table: int, mask: int, begin: int, keys: int, first: int, h: int, words: int) -> int:
    """What `sets.foresee` does: slots that are in use stay so, with their hash values."""
    i = begin
    while True:
        slot = acquired(table, i)
        if slot == 0:
            return i
        if (slot ^ h) & ~LOW == 0:
            if slot & LOW < first:
                prefetch(keys + ((slot & LOW) - 1) * words * 8)
            return i
        i = following(i, begin, mask)
        if (i ^ begin) & 7 == 0:
            prefetch(table + i * 8)
            return i


@helper
def enter_shared(
    table: int, mask: int, begin: int, i: int, keys: int, first: int, tasks: int, thread: int, entry: int, mine: int,
    words: int,
) -> int:  # fmt: skip
    """Look an entry up, or enter it as the slot value `mine`, whose low half is a temporary number; its PLACE, with the
    flag `s.WINNER` when it took a free slot. The search begins at slot `begin`, and goes on from slot i. Numbers from
    `first` on are temporary."""
    stride = (words + s.ENTRY_WORDS) * 8
    while True:
        slot = acquired(table, i)
        if slot == 0:
            wait(thread)
            slot = exchanged(table, i, 0, mine)
            if slot == 0:
                return s.WINNER | s.PENDING | i
        if (slot ^ mine) & ~LOW == 0:
            number = slot & LOW
            if number < first:
                if equal(keys + (number - 1) * words * 8, entry, words):
                    return number - 1
            else:
                place = number - first
                other = load64(tasks, (place >> s.POSITION_BITS) * s.TASK_WORDS + s.TASK_ENTRIES)
                if equal(other + (place & ((1 << s.POSITION_BITS) - 1)) * stride, entry, words):
                    while slot & LOW > mine & LOW:
                        wait(thread)
                        was = exchanged(table, i, slot, mine)
                        if was == slot:
                            break
                        slot = was
                    return s.PENDING | i
        i = following(i, begin, mask)


@helper
def look_up_all(shared: int, block: int, thread: int, task: int, start: int, end: int, at: int, words: int) -> bool:
    """Look up entries of a task, which begin at `at`; false when there is no room for them."""
    nodes, stride = load64(block, b.NODES), (words + s.ENTRY_WORDS) * 8
    table, mask, shift = load64(nodes, b.SET_TABLE), load64(nodes, b.SET_MASK), load64(nodes, b.SET_SHIFT)
    keys, first, tasks = load64(nodes, b.SET_KEYS), load64(nodes, b.SET_COUNT) + 1, load64(shared, s.TASK_TABLE)
    if added(shared, s.ROOM, end - start) + end - start > load64(nodes, b.SET_LIMIT):
        added(shared, s.ROOM, start - end)
        return False
    for n in range(start, end):
        h = load64(at + n * stride, words + s.HASH)
        i = foresee_shared(table, mask, shifted(h, shift), keys, first, h, words)
        store64(at + n * stride, words + s.PLACE, i)
    new, place = 0, first + (task << s.POSITION_BITS)
    for n in range(start, end):
        entry = at + n * stride
        h = load64(entry, words + s.HASH)
        mine = (h & ~LOW) | (place + n)
        begin, i = shifted(h, shift), load64(entry, words + s.PLACE)
        found = enter_shared(table, mask, begin, i, keys, first, tasks, thread, entry, mine, words)
        if found & s.WINNER != 0:
            new += 1
        store64(entry, words + s.PLACE, found & ~s.WINNER)
    added(shared, s.ROOM, new - (end - start))
    return True


@helper
def judge(shared: int, block: int, task: int, words: int) -> None:
    """Count the entries of a task that are the first of their node, and mark them."""
    nodes, stride, record = load64(block, b.NODES), (words + s.ENTRY_WORDS) * 8, task_record(shared, task)
    table, at = load64(nodes, b.SET_TABLE), load64(record, s.TASK_ENTRIES)
    place, new = load64(nodes, b.SET_COUNT) + 1 + (task << s.POSITION_BITS), 0
    for n in range(load64(record, s.TASK_COUNT)):
        slot = load64(at + n * stride, words + s.PLACE)
        if slot & s.PENDING != 0 and load64(table, slot & ~s.PENDING) & LOW == place + n:
            store64(at + n * stride, words + s.PLACE, slot | s.WINNER)
            new += 1
    store64(record, s.TASK_NEW, new)


@helper
def task_record(shared: int, task: int) -> int:
    return load64(shared, s.TASK_TABLE) + task * s.TASK_WORDS * 8


@helper
def sum_up(shared: int, block: int, words: int) -> None:
    """The numbers with which the new nodes and the edges of each task begin."""
    stride = (words + s.ENTRY_WORDS) * 8
    count, edges = load64(load64(block, b.NODES), b.SET_COUNT), load64(block, b.EDGE_COUNT)
    before, before_edges, crossed = count, edges, -1
    for task in range(load64(shared, s.TASKS)):
        record = task_record(shared, task)
        store64(record, s.TASK_FIRST, count)
        store64(record, s.TASK_FIRST_EDGE, edges)
        crossing = load64(record, s.TASK_CROSSING)
        if crossed < 0 and crossing >= 0:
            crossed = count
            for n in range(crossing):
                if load64(load64(record, s.TASK_ENTRIES) + n * stride, words + s.PLACE) & s.WINNER != 0:
                    crossed += 1
        count += load64(record, s.TASK_NEW)
        edges += load64(record, s.TASK_EDGES)
    store64(shared, s.FOUND, count - before)
    store64(shared, s.STORED, edges - before_edges)
    store64(shared, s.CROSSED, crossed)


@helper
def give_numbers(shared: int, block: int, thread: int, task: int, words: int) -> None:
    """Number the new nodes of a task, and put them where they stay."""
    nodes, stride, record = load64(block, b.NODES), (words + s.ENTRY_WORDS) * 8, task_record(shared, task)
    table, keys, parents = load64(nodes, b.SET_TABLE), load64(nodes, b.SET_KEYS), load64(block, b.PARENTS)
    at, number = load64(record, s.TASK_ENTRIES), load64(record, s.TASK_FIRST)
    start, fresh = load64(shared, s.START) + task * s.NODES_EACH, 0
    cycles = load64(block, b.CYCLES) != 0
    for n in range(load64(record, s.TASK_COUNT)):
        entry = at + n * stride
        place = load64(entry, words + s.PLACE)
        if place & s.WINNER != 0:
            for i in range(words):
                store64(keys, number * words + i, load64(entry, i))
            origin = load64(entry, words + s.LABEL)
            store32(parents, number, start + (origin & LOW))
            if not cycles or shifted(origin, 32) != b.NO_LABEL:
                fresh += 1
            number += 1
            store64(table, place & ~(s.WINNER | s.PENDING), (load64(entry, words + s.HASH) & ~LOW) | number)
    store64(thread, s.CONFIGURATIONS, load64(thread, s.CONFIGURATIONS) + fresh)


@helper
def store_edges(shared: int, block: int, task: int, words: int) -> None:
    """Store the edges of a task; where those of its nodes begin too."""
    nodes, stride, record = load64(block, b.NODES), (words + s.ENTRY_WORDS) * 8, task_record(shared, task)
    table, first = load64(nodes, b.SET_TABLE), load64(block, b.FIRST)
    targets, labels = load64(block, b.TARGETS), load64(block, b.LABELS)
    kept, sources = load64(block, b.KEPT), load64(block, b.SOURCES)
    at, edge, node = load64(record, s.TASK_ENTRIES), load64(record, s.TASK_FIRST_EDGE), -1
    start = load64(shared, s.START) + task * s.NODES_EACH
    for n in range(load64(record, s.TASK_COUNT)):
        entry = at + n * stride
        origin, target = load64(entry, words + s.LABEL), load64(entry, words + s.PLACE)
        if kept != 0:
            if load8(kept, shifted(origin, 32)) == 0:
                continue
            store32(sources, edge, start + (origin & LOW))
        while kept == 0 and node < origin & LOW:
            node += 1
            store64(first, start + node, edge)
        if target & s.PENDING != 0:
            target = (load64(table, target & ~(s.WINNER | s.PENDING)) & LOW) - 1
        store32(targets, edge, target)
        store32(labels, edge, shifted(origin, 32))
        edge += 1
    while kept == 0 and node < s.NODES_EACH:
        node += 1
        store64(first, start + node, edge)


@helper
def undo(shared: int, block: int, words: int) -> None:
    """Free all slots of temporary numbers: nothing was entered behind them that stays."""
    table, stride = load64(load64(block, b.NODES), b.SET_TABLE), (words + s.ENTRY_WORDS) * 8
    for task in range(load64(shared, s.TASKS)):
        record = task_record(shared, task)
        for n in range(load64(record, s.TASK_COUNT)):
            place = load64(load64(record, s.TASK_ENTRIES) + n * stride, words + s.PLACE)
            if place & s.PENDING != 0:
                store64(table, place & ~(s.WINNER | s.PENDING), 0)


@helper
def spread_shared(shared: int, block: int, task: int) -> None:
    """Move slots to where they belong in a table that has become twice as large, which is behind all that move."""
    nodes = load64(block, b.NODES)
    table, mask, shift = load64(nodes, b.SET_TABLE), load64(nodes, b.SET_MASK), load64(nodes, b.SET_SHIFT)
    start = load64(shared, s.START) + task * s.SLOTS_EACH
    for n in range(start, min(start + s.SLOTS_EACH, load64(shared, s.MOVED_TO))):
        slot = load64(table, n)
        if slot != 0:
            store64(table, n, 0)
            i = first = shifted(slot, shift)
            while exchanged(table, i, 0, slot) != 0:
                i = following(i, first, mask)


def work(fixed: int) -> Callable[[int], int]:
    """The kernel for nodes of `fixed` words (0: any number): does tasks until none is left, or all that one phase is.

    Its control block is that of a thread.
    """

    @helper
    def expand_task(shared: int, block: int, thread: int, task: int, words: int) -> int:
        """Expand the nodes of a task and look their successors up; a reason to undo the chunk, or 0."""
        record, stride = task_record(shared, task), (words + s.ENTRY_WORDS) * 8
        keys, start = load64(load64(block, b.NODES), b.SET_KEYS), load64(shared, s.START) + task * s.NODES_EACH
        table = load64(load64(block, b.NODES), b.SET_TABLE)
        shift = load64(load64(block, b.NODES), b.SET_SHIFT)
        batch, width, fresh = load64(thread, s.BATCH), load64(block, b.RECORD), load64(block, b.FRESH)
        for n in range(s.NODES_EACH):
            for i in range(words):
                store64(batch, n * width + i, load64(keys, (start + n) * words + i))
            for i in range(words, width):
                store64(batch, n * width + i, load64(fresh, i - words))
        context, source_at = load64(thread, s.CONTEXT), load64(block, b.CONTEXT_SOURCE)
        store64(context, source_at, 0)
        at = load64(thread, s.ARENA) + load64(thread, s.ENTRIES) * stride
        most = min(1 << s.POSITION_BITS, load64(shared, s.ENTRY_LIMIT) - load64(thread, s.ENTRIES))
        store64(record, s.TASK_ENTRIES, at)
        edges, edge_bytes, body_at = load64(thread, s.BUFFER), load64(block, b.EDGE_BYTES), load64(block, b.EDGE_BODY)
        capacity, configuration = load64(block, b.EDGES_CAPACITY), load64(block, b.CONFIGURATION)
        outputs, mask, last = width - configuration, load64(block, b.LETTER_MASK), load64(thread, s.LAST_KEY)
        last_label, cycles = load64(thread, s.LAST_LABEL), load64(block, b.CYCLES) != 0
        labelled = cycles or load64(block, b.WITH_LETTERS) != 0
        level_end, crossing = load64(block, b.LEVEL_END), -1
        current, group, count, done, steps, transitions = -1, 0, 0, 0, 0, 0
        kept, stored = load64(block, b.KEPT), 0
        while load64(context, source_at) < s.NODES_EACH:
            if steps > s.MOST_STEPS:
                return s.TOO_WIDE
            ready = expand(load64(block, b.EXPAND), batch, s.NODES_EACH, edges, capacity, context)
            for n in range(ready):
                edge = edges + n * edge_bytes
                source, status, body = load32(edge, b.EDGE_SOURCE), load32(edge, b.EDGE_STATUS), edge + body_at
                if source != current:
                    current, group = source, count
                    if crossing < 0 and start + source >= level_end:
                        crossing = count
                if status != 0:
                    if status == load64(block, b.BROKEN_STATUS):
                        return s.BROKEN
                    note_fault(block, thread, status, start + source)
                    continue
                label = b.NO_LABEL
                if labelled and (not cycles or ends_cycle(block, edge, body)):
                    letter = body + configuration * 8
                    same = last_label >= 0
                    for i in range(outputs):
                        same = same and load64(letter, i) & load64(mask, i) == load64(last, i)
                    if not same:
                        last_label = known_label(block, thread, letter)
                        if last_label < 0:
                            return s.NEW_LETTER
                    label = last_label
                    if cycles:
                        for i in range(configuration, words):
                            store64(body, i, load64(fresh, i - configuration))
                size, met, h = count - group, 0, 0
                if size < b.SMALL_GROUP:
                    for k in range(group, count):
                        if equal(at + k * stride, body, words):
                            met = 1
                            if shifted(load64(at + k * stride, words + s.LABEL), 32) == label:
                                met = 2
                                break
                    if met < 2:
                        h = hashed(body, words)
                else:
                    if size == s.MOST_SUCCESSORS:
                        return s.TOO_WIDE
                    h = hashed(body, words)
                    met = met_in_group(thread, at + group * stride, size, words, body, h, label)
                if met == 2:
                    continue
                if met == 0:
                    transitions += 1
                if count == most:
                    return s.NO_ROOM
                entry = at + count * stride
                for i in range(words):
                    store64(entry, i, load64(body, i))
                store64(entry, words + s.HASH, h)
                store64(entry, words + s.LABEL, source | label << 32)
                prefetch(table + shifted(h, shift) * 8)
                count += 1
                if kept == 0 or load8(kept, label) != 0:
                    stored += 1
            if not look_up_all(shared, block, thread, task, done, count, at, words):
                return s.NO_ROOM
            done, steps = count, steps + ready
            store64(record, s.TASK_COUNT, count)
        store64(record, s.TASK_EDGES, stored)
        store64(record, s.TASK_CROSSING, crossing)
        store64(thread, s.ENTRIES, load64(thread, s.ENTRIES) + count)
        store64(thread, s.STEPS, load64(thread, s.STEPS) + steps)
        store64(thread, s.TRANSITIONS, load64(thread, s.TRANSITIONS) + transitions)
        return 0

    def run(thread: int) -> int:
        shared = load64(thread, s.SHARED)
        block, phase, tasks = load64(shared, s.BLOCK), load64(shared, s.PHASE), load64(shared, s.TASKS)
        words = fixed or load64(block, b.WORDS)
        if phase == s.SUM:
            sum_up(shared, block, words)
            return b.DONE
        if phase == s.UNDO:
            undo(shared, block, words)
            return b.DONE
        while acquired(shared, s.FAILED) == 0:
            next_one = added(shared, s.NEXT, 1)
            if next_one >= tasks:
                break
            task = next_one * load64(shared, s.STRIDE) % tasks
            wait(thread)
            if phase == s.EXPAND:
                reason = expand_task(shared, block, thread, task, words)
                if reason != 0:
                    fail(shared, reason)
            elif phase == s.JUDGE:
                judge(shared, block, task, words)
            elif phase == s.NUMBER:
                give_numbers(shared, block, thread, task, words)
            elif phase == s.EDGES:
                store_edges(shared, block, task, words)
            else:
                spread_shared(shared, block, task)
        return b.DONE

    return run


kernel("work_1")(work(1))
kernel("work_2")(work(2))
kernel("work_any")(work(0))
