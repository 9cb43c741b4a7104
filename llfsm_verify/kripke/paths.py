"""Searches of a product, as Python calls them: for accepting components, for shortest paths, and for the product nodes
that are live; their stacks, queues and stores, and how these grow.
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.graph import Graph, Letters
from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.product import (
    MAX_SETS,
    NO_STATE,
    SIZES,
    TOO_MANY_NODES,
    ProductNode,
    ProductSearch,
    ProductTooLarge,
    Rows,
    Sizes,
    in_portions,
    packed,
)


class Components(ProductSearch):
    """The search for a component of the product that can be reached and has edges of all acceptance sets inside.

    Memory for each product node found: 4 bytes in a dense store (times the states of the automaton that a node is not
    found with), 20 to 28 in a sparse one; 8 more while its component is open, 16 while it is on the search path, 24 for
    each component on it.
    """

    kernel = "product_components"

    def __init__(self, graph: Graph, rows: Rows, sets: int, sizes: Sizes = SIZES) -> None:
        """`sets` acceptance sets, at most MAX_SETS."""
        if not 0 <= sets <= MAX_SETS:
            raise ValueError(f"{sets} acceptance sets")
        super().__init__(graph, rows, sizes, p.EMPTINESS_WORDS)
        self._starts, self._active, self._path, self._roots = (Region(1), Region(1), Region(1), Region(1))
        self._entries = 0
        self._block[p.FULL] = p.INNER | (1 << sets) - 1
        self._block[p.CLOSING] = -1
        self._grow_stacks(sizes.entries)

    @property
    def states(self) -> int:
        """States of the automaton for which a dense store has room."""
        return 0 if self._sparse else self._marks.size // (4 * max(1, len(self._graph)))

    def search(self, starts: Sequence[ProductNode]) -> bool:
        """Whether an accepting component can be reached; what former calls have found not to is not searched again."""
        self._rows.reserve(max((state for _, state in starts), default=0))
        self._starts.write(packed(starts).tobytes())
        self._block[p.STARTS], self._block[p.START_COUNT] = (self._starts.address, len(starts))
        self._block[p.STARTED] = self._block[p.START_STATES] = 0
        return self._run() == p.FOUND

    def search_found(self, reached: ProductSearch, states: Sequence[int]) -> bool:
        """The same from all product nodes that another search has found; from those that it has found since the last
        call. `states` are the states here for those there, or NO_STATE; product nodes with such are passed over."""
        self._rows.reserve(max((state for state in states if state != NO_STATE), default=0))
        self._starts.write(array("I", states).tobytes())
        self._block[p.STARTS], self._block[p.START_COUNT] = (reached.block[p.KEYS], reached.found)
        self._block[p.START_STATES] = self._starts.address
        return self._run() == p.FOUND

    def collect(self, most: int) -> None:
        """After `search` found one: go on for `most` edges, then mark the nodes of all accepting components known.

        Those still open count as far as they are known to be connected. Ends the search.
        """
        b = self._block
        b[p.COLLECTING] = 1
        if self._run(most) == p.PORTION:
            b[p.ENDING] = 1
            self._run()
        for region in (self._active, self._path, self._roots):
            region.close()

    def _dense_size(self, states: int) -> int:
        return 4 * states * len(self._graph)

    def _grow(self) -> None:
        b = self._block
        if b[p.ACTIVE_COUNT] == self._entries:
            self._grow_stacks(2 * self._entries)
        if self._sparse and self.found == b[p.CAPACITY]:
            self._more_slots()
            self._grow_store()
            self._rehash()

    def _grow_stacks(self, entries: int) -> None:
        if entries > p.MOST_NODES:
            raise ProductTooLarge(TOO_MANY_NODES)
        b = self._block
        self._entries = entries
        self._active.grow(8 * entries)
        self._path.grow(16 * entries)
        self._roots.grow(24 * entries)
        b[p.ACTIVE], b[p.PATH], b[p.ROOTS] = (self._active.address, self._path.address, self._roots.address)
        b[p.STACK_CAPACITY] = entries

    def _grow_store(self) -> None:
        self._keys.grow(8 * self._block[p.CAPACITY])
        self._marks.grow(4 * self._block[p.CAPACITY])

    def _thin(self) -> None:
        b = self._block
        dense, size = self._marks, self._marks.size // 4
        self._marks = Region(1)
        try:
            self._more_slots()
            self._grow_store()
            b[p.KEYS], b[p.MARKS] = self._keys.address, self._marks.address
            b[p.COUNT] = 0
            starts, b[p.STARTS] = b[p.STARTS], dense.address
            in_portions("product_thin", b, size)
            b[p.STARTS] = starts
        finally:
            dense.close()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._starts, self._active, self._path, self._roots


CLEARED_BYTES = 1 << 16
"""Larger memory is not cleared, but given back and asked for anew."""


class SearchTarget(Enum):
    """Product nodes to look for, unless it is a certain one."""

    NOTHING = p.NOTHING
    """None: all that can be reached is."""
    FLAGGED = p.FLAGGED
    """The targets of moves with acceptance."""
    ACCEPTING = p.MARKED
    """Those in the accepting components that a search for such has found."""


@dataclass(frozen=True, slots=True)
class PathStep:
    """One step of a path: the product node it leads to, and what the edge shows."""

    letter: Letters
    target: ProductNode


class Breadth(ProductSearch):
    """Breadth-first search for product nodes, nearest first; distances are counted in labels.

    Memory for each product node found: 12 bytes, and in a dense store a bit (for each state of the automaton), in a
    sparse one 8 to 16 bytes.
    """

    kernel = "product_breadth"

    def __init__(
        self,
        graph: Graph,
        rows: Rows,
        starts: Iterable[ProductNode],
        *,
        goal: ProductNode | SearchTarget,
        marks: tuple[Components, Sequence[int] | None] | None = None,
        within: bool = False,
        limit: int | None = None,
        sizes: Sizes = SIZES,
    ) -> None:
        """`goal`: the product nodes to look for; one of them must not be a start. `marks`: a search for components that
        has ended, with its state for each state here, or NO_STATE (None: the same); the sequence may grow. `within`:
        only product nodes in the accepting components found there are visited. `limit`: the largest distance.
        """
        super().__init__(graph, rows, sizes, p.BREADTH_WORDS)
        self._parents, self._bases = Region(1), Region(1)
        self._base_states: Sequence[int] = ()
        self._starts = Region(1)
        self.exhausted = False
        """There is no other goal."""
        self._based = 0
        b = self._block
        b[p.EPSILONS] = rows.silent
        b[p.DEPTH_LIMIT] = -1 if limit is None else limit
        if isinstance(goal, SearchTarget):
            b[p.GOAL] = goal.value
        else:
            b[p.GOAL], b[p.WANTED] = p.EXACTLY, goal[1] << 32 | goal[0]
        b[p.WITHIN] = within
        other: Components | None = None
        if marks is not None:
            other, states = marks
            self._base_states = states or ()
        if other is not None:
            source = other.block
            b[p.OTHER_MARKS], b[p.OTHER_SLOTS] = source[p.MARKS], source[p.SLOTS]
            b[p.OTHER_SHIFT], b[p.OTHER_KEYS] = source[p.SHIFT], source[p.KEYS]
            b[p.OTHER_STATES] = other.states
        self.start(starts)

    def start(self, starts: Iterable[ProductNode]) -> None:
        """Search from these as well when there is no other goal; distances are now those from the new ones."""
        keys = packed(starts)
        self._rows.reserve(max((key >> 32 for key in keys), default=0))
        self._fit()
        b = self._block
        if self.found + len(keys) >= b[p.QUEUE_CAPACITY]:
            self._grow_queue(max(2 * self.found, self.found + len(keys) + 1, self._sizes.entries))
        if self._sparse and self.found + len(keys) > b[p.CAPACITY]:
            self._more_slots(len(keys))
            self._rehash()
        self._starts.write(keys.tobytes())
        b[p.STARTS], b[p.START_COUNT] = self._starts.address, len(keys)
        b[p.MARKS], b[p.KEYS] = self._marks.address, self._keys.address
        kernels().run("product_start", ctypes.addressof(b))

    def restart(self, starts: Iterable[ProductNode], goal: ProductNode, limit: int | None = None) -> None:
        """Forget all product nodes found, and search for this one."""
        b = self._block
        b[p.COUNT] = b[p.CHECKED] = 0
        b[p.GOAL], b[p.WANTED] = p.EXACTLY, goal[1] << 32 | goal[0]
        b[p.DEPTH_LIMIT] = -1 if limit is None else limit
        if self._sparse:
            self._slots = _cleared(self._slots)
            b[p.SLOTS] = self._slots.address
        else:
            self._marks = _cleared(self._marks)
        self.start(starts)

    def next(self, most: int | None = None) -> int | None:
        """The number of the nearest goal not given yet; None: there is no other, or `most` more edges were taken."""
        code = self._run(most)
        self.exhausted = code == p.DONE
        return self._block[p.HIT] if code == p.FOUND else None

    @property
    def distance(self) -> int:
        """Letters from a start to the goal given last."""
        return self._block[p.HIT_DEPTH]

    def node(self, number: int) -> ProductNode:
        """The product node of a number."""
        key = ctypes.c_int64.from_address(self._keys.address + 8 * number).value
        return key & p.NODE, key >> 32

    def path(self, number: int) -> tuple[ProductNode, list[PathStep]]:
        """A shortest path to a product node: the start, and the steps."""
        numbers = [number]
        while (parent := self._parent(numbers[-1])) != numbers[-1]:
            numbers.append(parent)
        numbers.reverse()
        nodes = [self.node(n) for n in numbers]
        return nodes[0], [PathStep(self._letter(source, target), target) for source, target in pairwise(nodes)]

    def _letter(self, source: ProductNode, target: ProductNode) -> Letters:
        b = (ctypes.c_int64 * p.EDGE_WORDS)(*self._block[: p.SHARED_WORDS])
        b[p.ROWS], b[p.MOVES] = self._rows.rows.address, self._rows.moves.address
        b[p.EDGE_FROM], b[p.EDGE_TO] = packed((source, target))
        kernels().run("product_edge", ctypes.addressof(b))
        assert b[p.EDGE_FOUND] >= 0, "a step of a path is not an edge of the product"
        label = ctypes.c_uint32.from_address(self._graph.labels.address + 4 * b[p.EDGE_FOUND]).value
        return self._graph.shown(label)

    def _parent(self, number: int) -> int:
        return ctypes.c_uint32.from_address(self._parents.address + 4 * number).value

    def _fit(self) -> None:
        super()._fit()
        if self._base_states and self._based < len(self._base_states):
            self._bases.write(array("I", self._base_states[self._based :]).tobytes(), 4 * self._based)
            self._based = len(self._base_states)
            self._block[p.BASES] = self._bases.address

    def _dense_size(self, states: int) -> int:
        return 8 * (states * len(self._graph) // 64 + 1)

    def _grow(self) -> None:
        b = self._block
        if self.found == b[p.QUEUE_CAPACITY]:
            self._grow_queue(2 * self.found)
        if self._sparse and self.found == b[p.CAPACITY]:
            self._more_slots()
            self._rehash()

    def _grow_queue(self, entries: int) -> None:
        if entries > p.MOST_NODES:
            raise ProductTooLarge(TOO_MANY_NODES)
        b = self._block
        self._keys.grow(8 * entries)
        self._parents.grow(4 * entries)
        b[p.QUEUE_CAPACITY], b[p.PARENTS] = entries, self._parents.address

    def _thin(self) -> None:
        self._marks.close()
        self._marks = Region(1)
        self._more_slots()
        self._rehash()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._parents, self._bases, self._starts


def _cleared(region: Region) -> Region:
    """The region with zeros everywhere, or another one instead of it."""
    if region.size > CLEARED_BYTES:
        region.close()
        return Region(region.size)
    ctypes.memset(region.address, 0, region.size)
    return region


class Living(Breadth):
    """All product nodes that can be reached, nearest first, and which of them are live: an accepting component can be
    reached.

    A bit more for each product node than in `Breadth`. What is live is found by sweeps, from the product node found
    last to the first, until one finds no more; each takes time for all edges of what is not live.
    """

    kernels = ("product_live", "product_lost")
    """Those that it needs beside that of `Breadth`."""

    def __init__(
        self, graph: Graph, rows: Rows, starts: Iterable[ProductNode], components: Components, sizes: Sizes = SIZES
    ) -> None:
        """`components`: a search that has found an accepting component from `starts`, with the same states, and has
        ended (`Components.collect`) with all of them."""
        super().__init__(graph, rows, starts, goal=SearchTarget.NOTHING, marks=(components, None), sizes=sizes)
        self._live, self._watched = Region(1), Region(1)

    def sweep(self) -> None:
        """Reach everything, and find out what is live."""
        b = self._block
        self.next()
        self._fit()
        places = self.found if self._sparse else self._rows.states * len(self._graph)
        self._live.grow(8 * (places // 64 + 1))
        b[p.LIVE] = self._live.address
        b[p.LEARNT] = 1
        while b[p.LEARNT]:
            b[p.LEARNT], b[p.LEFT] = 0, self.found
            self._run_kernel("product_live")

    def lost(self, watched: Sequence[int]) -> Iterator[int]:
        """After `sweep`, the numbers of the product nodes that are not live, nearest first; only of those with a state
        that `watched` marks with 1."""
        b = self._block
        self._watched.write(array("I", watched).tobytes())
        b[p.WATCHED] = self._watched.address
        b[p.POSITION] = 0
        while self._run_kernel("product_lost") == p.FOUND:
            yield b[p.HIT]

    def _run_kernel(self, name: str) -> int:
        self.kernel = name
        return self._run()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._live, self._watched
