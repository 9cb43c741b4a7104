"""The search for accepting components of a product, as Python calls it: its stacks, its store, and their growth."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

from llfsm_verify.kripke.graph import Graph
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
