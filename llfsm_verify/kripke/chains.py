"""Chains of steps without a choice: what exploring them needs, their moves, and the configurations they pass.

A configuration with one step only need not be stored: a graph of chains has edges that stand for many steps and show a
word of letters (`kernels.chains`, docs/decisions/0012-chains.md).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator

from llfsm_verify.backends.native.context import PREFIX, PROCESS, STEPPED
from llfsm_verify.backends.native.executor import Edge, NativeProgram
from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.graph import MAX_NODES, Graph, Sequences
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels import chain_blocks as c
from llfsm_verify.kripke.memory import Region, VectorSet
from llfsm_verify.limits import Budget, LimitReached

FIRST_SLOTS = 4 * c.MAX_CHAIN
"""Slots of the first tables: there must be room for more than one chain."""
FEWEST = 1 << 16
"""Configurations between nodes for which there must be memory at a time, or they are not counted."""

Block = ctypes.Array[ctypes.c_int64]


class Chains:
    """Memory for the kernels of an exploration by chains; `graph.sequences` gets the words of letters."""

    def __init__(self, kernels: Kernels, native: NativeProgram, graph: Graph, fresh: bytes, edges: int) -> None:
        """`fresh` are the output words of a record before its step; the exploration's buffer has room for `edges`."""
        self._kernels = kernels
        self._native = native
        self._graph = graph
        self._fresh = fresh
        self.words = VectorSet(kernels, 1, Region(1), FIRST_SLOTS)
        """Pairs of a prefix and a letter."""
        graph.sequences = Sequences(graph.alphabet, self.words.keys)
        self.is_restored = False
        """The graph goes on from a checkpoint, and perhaps its chains do not end at its nodes."""
        self._context = native.new_context()
        key = 8 * graph.words
        walkers = c.MOST_WALKERS * (8 + key)
        sizes = (key + len(fresh), key, key, 2 * native.edge_size, 8 * c.MAX_CHAIN, 8, walkers, 8 * edges)
        self._scratch = [Region(size) for size in sizes]
        current, saved, least, steps, letters, pair, walks, queue = (r.address for r in self._scratch)
        self._scratch[0].write(fresh, key)
        self._block: Block = (ctypes.c_int64 * c.CHAIN_WORDS)()
        settings = {
            c.CURRENT: current, c.SAVED: saved, c.LEAST: least, c.STEPS: steps, c.LETTERS: letters, c.PAIR: pair,
            c.CONTEXT: ctypes.addressof(self._context), c.WORDS: self.words.address, c.WALKERS: walks, c.QUEUE: queue,
            c.CONTEXT_PROCESS: PROCESS, c.CONTEXT_STEPPED: STEPPED, c.CONTEXT_PREFIX: PREFIX,
        }  # fmt: skip
        for word, value in settings.items():
            self._block[word] = value

    @property
    def address(self) -> int:
        """Of the control block."""
        return ctypes.addressof(self._block)

    @property
    def is_full(self) -> bool:
        """There is no room for the words of one more chain."""
        return self.words.limit - self.words.count < c.MAX_CHAIN

    def check(self, budget: Budget) -> None:
        """Raises LimitReached when the words must not grow."""
        if self.words.limit >= MAX_NODES // 2:
            raise LimitReached(f"the chains of steps show more than {self.words.limit:,} words of letters")
        budget.check(self.words.table_bytes)

    def grow(self) -> None:
        """Make room for more words."""
        self.words.grow()

    def read_back(self) -> None:
        """Let the graph know the words found."""
        assert self._graph.sequences is not None
        self._graph.sequences.count = self.words.count

    def from_edge(self, edge: Edge) -> Iterator[Edge]:
        """A step of the graph, and the steps that follow it as far as they have no choice, at most MAX_CHAIN in all."""
        width = self._native.layout.configuration_bytes
        for _ in range(c.MAX_CHAIN):
            yield edge
            following = list(self._native.edges(edge.record[:width] + self._fresh, 1))
            if len(following) != 1 or following[0].status:
                return
            edge = following[0]

    # -------------------------------------------------- counting

    def count(self, block: Block, budget: Budget, serve: Callable[[int], None]) -> None:
        """Count configurations and transitions of the whole graph, those between its nodes included, and set the
        graph's numbers. They are passed again, those of one class at a time: all in one class, or in more passes when
        there is not memory for all.

        `block` is the exploration's; `serve` does what a kernel's code asks for. Raises LimitReached; the numbers are
        then too small.
        """
        graph, transitions = self._graph, 0
        classes = [(1, 0)]
        slots = FIRST_SLOTS
        while classes:
            budget.check()
            modulus, number = classes.pop()
            interior = VectorSet(self._kernels, graph.words, Region(1), slots)
            try:
                if self._count_class(block, interior, modulus, number, budget, serve):
                    graph.configurations += interior.count
                    transitions += interior.count + self._block[c.SUCCESSORS]
                    graph.transitions = max(graph.transitions, transitions)
                else:
                    classes += [(2 * modulus, number), (2 * modulus, number + modulus)]
                slots = interior.slots
            finally:
                interior.close()
                interior.keys.close()

    def _count_class(
        self, block: Block, interior: VectorSet, modulus: int, number: int, budget: Budget, serve: Callable[[int], None]
    ) -> bool:
        """Pass all chains and enter the configurations of one class; false when a limit ends that: perhaps fewer
        configurations would fit. Raises LimitReached where they would be too few."""
        settings = {
            c.INTERIOR: interior.address, c.CLASSES: modulus, c.CLASS: number, c.NEXT: 0, c.END: self._graph.expanded,
            c.SOURCE: -1, c.SUCCESSORS: 0, c.QUEUE_COUNT: 0, c.QUEUE_DONE: 0, c.ACTIVE: 0,
        }  # fmt: skip
        for word, value in settings.items():
            self._block[word] = value
        block[b.BATCH_COUNT] = block[b.EDGES_DONE] = block[b.EDGES_COUNT] = block[b.GROUP_COUNT] = 0
        while (code := self._kernels.run("count_chains", ctypes.addressof(block))) != b.DONE:
            full = code == b.ROOM_NODES
            more = 2 * interior.table_bytes + 8 * interior.words * interior.count
            try:
                budget.check(more if full else 0)
            except LimitReached:
                # A walk ends where it was before, if that is of its class; else it may go round forever between nodes.
                if interior.count < FEWEST or self.is_restored:
                    raise
                return False
            if full:
                interior.grow()
            else:
                serve(code)
        return True

    def close(self) -> None:
        """Give the memory back."""
        for region in (*self._scratch, self.words.keys):
            region.close()
        self.words.close()
