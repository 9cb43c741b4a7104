"""Control blocks of the product kernels: what lies in which word, and why a kernel returned. Imports nothing."""

from __future__ import annotations

EPSILON = 0xFFFFFFFF
"""The label of an edge that shows no letter (`kripke.graph.EPSILON`)."""

NO_STATE = 0xFFFFFFFF
"""A state of one automaton has no counterpart in another."""

# Why a kernel returned.
DONE, PORTION, NEED, GROW, FOUND = range(5)
"""Nothing is left; a portion is done; a row of moves is missing; there is no room; what is looked for is found."""

# Marks of product nodes in a search for components; 0: not found yet, else 1 + the place among the active nodes.
CLOSED = 0xFFFFFFFF
"""The node's component is closed, and not accepting."""
ACCEPTING = 0xFFFFFFFE
"""The node is in an accepting component."""
INNER = 1 << 62
"""Beside the acceptance sets of a component: it has an edge inside."""
MOVE_BITS = 16
MOST_MOVES = (1 << MOVE_BITS) - 1
"""Moves of an automaton from one state with one letter."""
MOST_NODES = 0xFFFFFFF0
"""Product nodes that a search can number."""

NODE = 0xFFFFFFFF
"""A product node is ``state << 32 | node``: a state of the automaton and a node of the graph."""

# What all kernels of the product read.
(
    FIRST,  # address: where the edges of a node begin, 64 bits
    TARGETS,  # address: their targets, 32 bits
    LABELS,  # address: their labels, 32 bits
    EXPANDED,  # nodes that have edges
    NODES,  # of the graph
    CLASSES,  # address: the class of letters of each label, 32 bits
    STRIDE,  # classes of letters; the last one is for edges that show none
    ROWS,  # address: by state and class, where in MOVES the row is, 32 bits; 0: missing
    MOVES,  # address of rows: how many moves, then the target and the acceptance of each, 64 bits
    NEED_STATE,  # the row that is missing
    NEED_CLASS,
    MARKS,  # address: by state and node in a dense store, by number in a sparse one
    SLOTS,  # address of the table of a sparse store, 32 bits: 1 + the number; 0: the store is dense
    SHIFT,  # 64 - the binary logarithm of its slots
    KEYS,  # address of the product nodes by number, 64 bits
    COUNT,  # product nodes found
    CAPACITY,  # the COUNT at which a sparse store must grow
    STARTS,  # address of product nodes to search from
    START_COUNT,
    ENTER_BEGIN,  # `product_rehash`: the first number to enter; `product_thin`: the first place of the dense store
    ENTER_END,  # and the one to end before
    WORK,  # edges to take before returning
    DONE_WORK,  # edges taken, over all calls
    SHARED_WORDS,
) = range(24)

# The search for accepting components (`kernels.emptiness`).
(
    FULL,  # the mask of all acceptance sets, and INNER
    STARTED,  # of them begun
    START_STATES,  # address: the state here for each state of the starts, 32 bits, or NO_STATE; 0: the same
    ACTIVE,  # address of the active product nodes, 64 bits
    ACTIVE_COUNT,
    PATH,  # address of two words for each node of the search path: its next edge and move; edges left and its place
    PATH_COUNT,
    ROOTS,  # address of three words for each component on the path: place, acceptance of entering, acceptance inside
    ROOT_COUNT,
    STACK_CAPACITY,  # of each of the three, in entries
    CLOSING,  # nodes are being marked down to this place; -1: none are
    CLOSING_MARK,
    COLLECTING,  # do not return at an accepting component, mark it when it is closed
    ENDING,  # close every component as it is
    EMPTINESS_WORDS,
) = range(SHARED_WORDS, SHARED_WORDS + 15)

# Breadth-first search (`kernels.paths`).
(
    QUEUE_CAPACITY,  # room in KEYS, which is the queue, and in PARENTS
    PARENTS,  # address: the number of the product node from which each was first found, 32 bits
    POSITION,  # the product node whose edges are next
    EDGE,  # its next edge
    MOVE,  # the next move of that edge
    BEGUN,  # EDGE and MOVE are those of POSITION
    LAYER,  # the first product node of this distance
    LAYER_END,  # the first one of the next distance
    SILENT,  # edges that show no letter are taken now, and do not lead to the next distance
    EPSILONS,  # there are such edges
    DEPTH,  # the distance of the layer
    DEPTH_LIMIT,  # farther product nodes are not looked for
    GOAL,  # what is looked for, see below
    WANTED,  # that product node
    WITHIN,  # only product nodes with the mark ACCEPTING are visited
    BASES,  # address: the state of the other search for each state of this one, 32 bits, or NO_STATE; 0: the same
    OTHER_MARKS,  # the store of the search for components
    OTHER_SLOTS,
    OTHER_SHIFT,
    OTHER_KEYS,
    OTHER_STATES,  # states for which a dense store there has room
    CHECKED,  # the first product node that has not been compared with the goal as a start
    CHECK_END,  # the end of the starts
    HIT,  # the number of the product node found
    HIT_DEPTH,  # its distance
    LIVE,  # address: bits of what is live, by state and node in a dense store, by number in a sparse one
    LEFT,  # product nodes that the sweep has yet to look at, the first ones
    LEARNT,  # the sweep has found more that is live
    WATCHED,  # address: whether each state is one to look for, 32 bits
    BREADTH_WORDS,
) = range(SHARED_WORDS, SHARED_WORDS + 30)

FLAGGED, MARKED, EXACTLY, NOTHING = range(4)
"""Goals: targets of moves with acceptance; nodes marked ACCEPTING by the other search; the node WANTED; none."""

# Which edge leads from one product node to another (kernel `product_edge`).
EDGE_FROM, EDGE_TO, EDGE_FOUND, EDGE_WORDS = range(SHARED_WORDS, SHARED_WORDS + 4)
