"""The control block of chains, and the sizes on which kernels and Python agree."""

from __future__ import annotations

MAX_CHAIN = 1024
"""Steps of a chain, at most: kernels return soon, and a word of letters has its room before a chain is walked."""
MILESTONE_MASK = 63
"""A configuration whose hash value is 0 under this mask ends every chain: one of 64. The high bits of the hash value
choose the slot in the table, so the low ones are free for such a choice."""
CLASS_SHIFT = 6
"""From this bit of the hash value on, the class to which a configuration belongs when counting takes several passes."""

(
    CURRENT,  # address of a record: the configuration at the end of the chain so far, and fresh outputs
    SAVED,  # address of a configuration: an earlier one of this chain, to notice that it runs in a loop
    LEAST,  # address of the configuration with the least hash value since the saved one
    STEPS,  # address of room for two edges
    CONTEXT,  # address of a context of its own for the step program
    CONTEXT_PROCESS,  # indices in the context, with the exploration's CONTEXT_SOURCE
    CONTEXT_STEPPED,
    CONTEXT_PREFIX,
    WORDS,  # address of the set of words: 64-bit pairs of a prefix (high half) and a letter
    LETTERS,  # address of the letters of the chain, 64 bits each
    PAIR,  # address of one such pair: scratch
    INTERIOR,  # address of the set of configurations between nodes, while they are counted
    CLASSES,  # counting takes configurations of one class of so many, a power of two, in one pass
    CLASS,  # that class
    NEXT,  # the first node of the batch whose steps are counted
    END,  # the node to end before
    SOURCE,  # the node whose steps are coming in
    SUCCESSORS,  # distinct pairs of a node and a direct successor, of this class
    QUEUE,  # address: the steps in the buffer from which walks are due, 64 bits each
    QUEUE_COUNT,
    QUEUE_DONE,  # walks begun
    WALKERS,  # address: for each walk a hash value, and the configuration that it belongs to
    ACTIVE,  # walks under way: the first ones
    CHAIN_WORDS,
) = range(24)

MOST_WALKERS = 16
"""Walks at the same time, so that the waits for memory overlap."""
NO_PREFIX = 0xFFFFFFFF
"""The prefix of a word of one letter."""
NO_ROOM = -1
"""There is no room for another letter or word."""
