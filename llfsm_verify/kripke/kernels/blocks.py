"""Control blocks: what lies in which word, and why a kernel returned. Shared by the kernels and by Python."""

from __future__ import annotations

# Why a kernel returned.
DONE, PORTION, BROKEN = 0, 1, 2
"""All is done; a portion is done; the step program contradicts itself."""
ROOM_NODES, ROOM_EDGES, ROOM_LETTERS, ROOM_GROUP = 3, 4, 5, 6
"""More room is needed: for nodes, for edges, for letters, for the successors of one node."""

REBUILD_WORDS, REBUILD_START, REBUILD_END, REBUILD_PASSED = 6, 7, 8, 9
"""After the words of a set, for the kernels `rebuild` and `enter_distinct`: words of a vector, the first to enter, the
one to end before; for the latter how many slots in use its searches may still pass."""
REHASH_OLD, REHASH_START, REHASH_END, REHASH_TABLE, REHASH_MASK, REHASH_SHIFT = range(6)
"""For the kernels `rehash` and `spread`: where the slots are, the first to move and the one to end before, the table as
in a set."""
REGROUP_TABLE, REGROUP_MASK, REGROUP_GENERATION, REGROUP_OLD, REGROUP_OLD_SLOTS = range(5)
"""For the kernel `regroup`: the new table, its slots - 1, the generation to keep, the old table and its slots."""

# A set of vectors of words, numbered in the order of insertion (`kernels.sets`).
SET_KEYS, SET_COUNT, SET_LIMIT, SET_TABLE, SET_MASK, SET_SHIFT = range(6)
"""Address of the vectors; their number; the number at which the set must grow; address of the table; its slots - 1; 64
minus the number of bits of a slot's index."""

# The exploration (`kernels.exploration`).
(
    NODES,  # address of the set of nodes
    LETTERS,  # address of the set of letters: output words under LETTER_MASK
    WORDS,  # of a node
    CONFIGURATION,  # words of a configuration
    RECORD,  # words of a record: a configuration and the outputs of the step that led to it
    CYCLES,  # only whole cycles have a letter
    CYCLE_WORD,  # word and bit of a record that tell the end of a cycle
    CYCLE_BIT,
    WITH_EDGES,
    WITH_LETTERS,  # letters are numbered, also where edges are not stored
    FRESH,  # address of the output words before a step
    LETTER_MASK,  # address of output words in which the observed bits are set
    LETTER_KEY,  # address of output words: scratch
    LAST_KEY,  # address of output words: those of the letter seen last
    LAST_LABEL,  # its label; -1: none yet
    LETTER_SOURCES,  # address: for each label the first node whose steps show it, 32 bits
    EXPAND,  # address of the step program's `expand`
    CONTEXT,  # address of its context
    CONTEXT_SOURCE,  # index in the context: the record due next
    EDGE_BYTES,
    EDGE_BODY,  # offset of the record in an edge
    BROKEN_STATUS,
    OVERFLOW_STATUS,
    BATCH,  # address of the records of the batch
    BATCH_CAPACITY,
    BATCH_COUNT,  # records in the batch; 0: none is under way
    EDGES,  # address of the buffer of edges
    EDGES_CAPACITY,
    EDGES_COUNT,  # edges in the buffer
    EDGES_READY,  # of them with label and hash value
    EDGES_DONE,  # of them looked up
    EDGE_HASHES,  # address of their hash values, 64 bits
    EDGE_LABELS,  # address of their labels, 64 bits
    EDGE_SLOTS,  # address of the slots where their searches go on, 64 bits
    PARENTS,  # address
    FIRST,  # address
    TARGETS,  # address
    LABELS,  # address
    KEPT,  # address: for each label whether its edges are stored, 8 bits, then with SOURCES, not FIRST; 0: all are
    KEPT_LETTERS,  # labels for which that is known
    SOURCES,  # address: the sources of the edges stored, 32 bits
    EDGE_COUNT,  # edges stored
    EDGE_LIMIT,  # room for so many
    SOURCE,  # the node whose successors are coming in; -1: none
    SOURCE_EDGES,  # how many have come in
    EXPANDED,  # nodes whose successors are all in
    STOP,  # expand nodes before this one
    FOUND_STOP,  # return soon when there are so many nodes
    SETTLE,  # begin no batch
    LEVEL_END,  # the node with which the next level begins
    DEPTH,
    TRANSITIONS,
    CONFIGURATIONS,
    FAULTS,  # address: for each fault the first node, or -1
    OVERFLOW,  # the first node whose step overflows, or -1
    GROUP_FIRST,  # address of pairs of a target and a label: the first few successors of SOURCE
    GROUP_COUNT,  # distinct pairs
    GROUP_TABLE,  # address of (generation, target, label) triples
    GROUP_MASK,
    GROUP_LIMIT,
    GENERATION,
    PORTION_EDGES,  # return after so many edges
    SEEN_EDGES,  # edges processed: by these the caller judges the rate
    CHAINS,  # address of the control block of chains (`chain_blocks`); 0: there are none
    EXPLORATION_WORDS,
) = range(65)

SMALL_GROUP = 8
"""Successors of a node that are compared one by one; more of them go through the group table."""
MAX_STEPS = 1 << 24
"""Steps from one configuration: inputs wider than this are not for enumeration. Kernels return when there are more."""
NO_LABEL = 0xFFFFFFFF
"""`kripke.graph.EPSILON`; also the label that stands for a target alone in the group table."""

EDGE_SOURCE, EDGE_PROCESS, EDGE_STATUS = 0, 1, 2
"""The 32-bit words of an edge's header (`backends.native.context`)."""
STUTTER = 0xFFFFFFFF
"""The process of the step of an arrangement that has ended."""

# Counting the steps that are whole cycles (kernel `cycle_pairs`).
(
    PAIRS_NODES,
    PAIRS_ROOTS,
    PAIRS_FIRST,
    PAIRS_TARGETS,
    PAIRS_LABELS,
    PAIRS_CLOSED,  # address, 32 bits a node: not in the middle of a cycle
    PAIRS_STAMPS,  # address, 32 bits a node: 1 + the configuration from which it was last reached
    PAIRS_STACK,  # address, 32 bits a node
    PAIRS_NEXT,
    PAIRS_FOUND,
    PAIRS_WORDS,
) = range(11)
PAIRS_PORTION = 1 << 14
"""Configurations in one call."""
