"""The control blocks of an exploration by several threads, and the sizes on which kernels and Python agree."""

from __future__ import annotations

# Of all threads together.
(
    BLOCK,  # address of the control block of the exploration (`blocks`)
    PHASE,  # what is done with each task
    START,  # the first node of the chunk
    TASKS,  # how many tasks the chunk has
    TASK_TABLE,  # address: TASK_WORDS words a task
    STRIDE,  # tasks are taken in steps of so many, which has no factor in common with TASKS
    DELAY,  # not 0: threads wait at random places (for tests)
    STRIDE_BYTES,  # of an entry
    ENTRY_LIMIT,  # entries for which the arena of a thread has room
    FOUND,  # after SUM: new nodes of the chunk
    STORED,  # after SUM: edges of the chunk that are stored
    CROSSED,  # after SUM: how many nodes are known when the next level begins; -1: it does not begin in this chunk
    MOVED_TO,  # SPREAD: the slot before which the slots of this round end
) = range(13)
NEXT, ROOM, FAILED, SHARED_WORDS = 16, 24, 32, 40
"""Words that threads change, each in a cache line of its own: the next task; nodes, with entries that are being looked
up; why the chunk has to be undone, if it has."""

EXPAND, JUDGE, SUM, NUMBER, EDGES, UNDO, SPREAD = range(7)
"""Phases. All threads: expand nodes and look up; count what is new; give numbers; store edges; move slots of a table
that has become twice as large. One thread: sums of counts; undo."""

# Of one thread.
(
    SHARED,  # address of the block of all threads
    CONTEXT,  # address of a context for the step program
    BATCH,  # address of the records of a task
    BUFFER,  # address of the buffer of edges
    ARENA,  # address of entries
    ENTRIES,  # entries of this chunk in the arena
    GROUP,  # address of the table of one node's successors
    GENERATION,  # of its entries
    KEY,  # address of output words: scratch
    LAST_KEY,  # address of output words: those of the letter seen last
    LAST_LABEL,
    STEPS,  # of this chunk, those that fault included
    TRANSITIONS,  # of this chunk
    CONFIGURATIONS,  # new ones of this chunk
    FAULTS,  # address: for each fault, and then for overflow, the first node of this chunk, or -1
    FAULTED,  # some of them is not -1
    RANDOM,  # state of the generator of delays
    THREAD_WORDS,
) = range(18)

(
    TASK_ENTRIES,  # address of its entries
    TASK_COUNT,  # how many there are
    TASK_NEW,  # of them new nodes
    TASK_FIRST,  # number of the first of these
    TASK_EDGES,  # edges that are stored
    TASK_FIRST_EDGE,
    TASK_CROSSING,  # entries before the first node of the next level; -1: there is none with steps
    TASK_WORDS,
) = range(8)

NODES_EACH = 64
"""Nodes of a task, as many as `kripke.tables.BATCH`: buffers then end where those of one thread do."""
POSITION_BITS = 16
"""Bits of the place of an entry in its task."""
GROUP_SLOTS, MOST_SUCCESSORS = 1 << 13, 1 << 12
"""Slots of the table of one node's successors, and how many it may have: nodes with more are for one thread."""
MOST_STEPS = 1 << 16
"""Steps of a task, about: nodes with more are for one thread too, so that signals do not wait for long."""
SLOTS_EACH = 1 << 14
"""Slots of a task of SPREAD."""

# An entry: the words of a node, and then these.
HASH, PLACE, LABEL, ENTRY_WORDS = 0, 1, 2, 3
"""Hash value; the number of a node that was known before, or the slot of a new one with flags; source in the low half,
label in the high one."""
PENDING, WINNER = 1 << 62, 1 << 61
"""Flags of PLACE: a new node; this entry is its first."""

NEW_LETTER, NO_ROOM, TOO_WIDE, BROKEN = 1, 2, 3, 4
"""Why a chunk has to be undone: a letter without a number, no room for nodes or entries, a node with too many
successors, a step program that contradicts itself."""
