"""The memory of an exploration: tables, buffers, and the control block that tells the kernels where they are."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from llfsm_verify.backends.native.code import BROKEN, OVERFLOW
from llfsm_verify.backends.native.context import SOURCE
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.interrupts import whole
from llfsm_verify.kripke.checkpoint import Numbers, Section, Unusable, sizes
from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.graph import FIRST_BYTES, MAX_NODES, NUMBER_BYTES, Graph
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.memory import OutOfMemory, Region, VectorSet
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.limits import Budget, LimitReached, reached

if TYPE_CHECKING:
    from llfsm_verify.kripke.chains import Chains
    from llfsm_verify.kripke.sharing import Sharing

BATCH = 64
"""Configurations expanded in one call of the step program."""
BUFFER_BYTES = 1 << 15
"""About what the buffer of their successors takes: it should stay in the first-level cache."""
FIRST_EDGES = 1 << 12
"""Edges for which there is room in the beginning."""
FIRST_GROUP = 1 << 12
"""Slots of the table of one configuration's successors, in the beginning."""
GROUP_SLOT_BYTES = 16
LETTERS_EACH = 64
"""Successors of one configuration, with different letters, that may stand for one configuration more."""


class Tables:
    """What the kernels read and write while they explore `graph`: its regions, sets of nodes and letters, buffers.

    `block` is the kernels' control block (see `kernels.blocks`). `sound`: nothing was interrupted in the middle of a
    change, so that the tables can be saved.
    """

    def __init__(
        self, native: NativeProgram, graph: Graph, observer: Observer, compiled: Kernels, roots: Sequence[bytes],
        *, with_chains: bool, jobs: int,
    ) -> None:  # fmt: skip
        self._native = native
        self._program = native.program
        self._graph = graph
        self._observer = observer
        self._kernels = compiled
        self.sound = True
        layout = native.layout
        self._width = layout.configuration_bytes
        self._fresh = layout.encode_outputs(layout.initial_outputs())
        self.nodes = VectorSet(compiled, graph.words, graph.keys)
        self.nodes.add_all(b"".join(r[: 8 * graph.words] for r in roots))
        self._letters = VectorSet(compiled, layout.output_words, Region(1))
        graph.parents.grow(self.nodes.limit * NUMBER_BYTES)
        graph.parents.write(b"".join(i.to_bytes(NUMBER_BYTES, "little") for i in range(len(roots))))
        self._edge_limit, self._group_slots = FIRST_EDGES, FIRST_GROUP
        self._group = Region(FIRST_GROUP * GROUP_SLOT_BYTES)
        self._keeps: Callable[[int], bool] = bool
        self._kept = Region(1)
        self._context = native.new_context()
        self.block = self._control_block(len(roots))
        self._jobs = jobs
        self._sharing: Sharing | None = None
        self.chains: Chains | None = None
        if with_chains:
            from llfsm_verify.kripke.chains import Chains

            self.chains = Chains(compiled, native, graph, self._fresh, self.block[b.EDGES_CAPACITY])
            self.block[b.CHAINS] = self.chains.address
        graph.roots = len(roots)
        self.place()
        self.read_back()

    def _control_block(self, roots: int) -> ctypes.Array[ctypes.c_int64]:
        graph, layout, native, program = self._graph, self._native.layout, self._native, self._program
        outputs, record_words = layout.output_words, layout.words + layout.output_words
        edge_bytes = native.edge_size
        capacity = max(1, BUFFER_BYTES // edge_bytes)
        self._scratch = [
            Region(size)
            for size in (
                BATCH * 8 * record_words,  # 0: the batch
                capacity * edge_bytes,  # 1: its edges
                capacity * 24,  # 2: their hash values, labels and slots
                8 * outputs * 4 + 8,  # 3: fresh, mask, two keys of letters
                8 * b.SMALL_GROUP,  # 4: the small group
                8 * max(1, len(program.faults)),  # 5: faults
            )
        ]
        batch, edges, prepared, letters, small, faults = (r.address for r in self._scratch)
        self._scratch[3].write(self._fresh + self._observer.mask())
        self._scratch[5].write(b"\xff" * (8 * len(program.faults)))
        field = layout.fields[program.cycle]
        block = (ctypes.c_int64 * b.EXPLORATION_WORDS)()
        settings = {
            b.NODES: self.nodes.address, b.LETTERS: self._letters.address,
            b.WORDS: graph.words, b.CONFIGURATION: layout.words, b.RECORD: record_words,
            b.CYCLES: int(program.observe == "cycle"), b.CYCLE_WORD: field.place(0)[0], b.CYCLE_BIT: field.place(0)[1],
            b.WITH_LETTERS: int(graph.with_edges),
            b.FRESH: letters, b.LETTER_MASK: letters + 8 * outputs,
            b.LETTER_KEY: letters + 16 * outputs, b.LAST_KEY: letters + 24 * outputs, b.LAST_LABEL: -1,
            b.CONTEXT: ctypes.addressof(self._context), b.CONTEXT_SOURCE: SOURCE,
            b.EDGE_BYTES: edge_bytes, b.EDGE_BODY: native.record_offset,
            b.BROKEN_STATUS: BROKEN & 0xFFFFFFFF, b.OVERFLOW_STATUS: OVERFLOW & 0xFFFFFFFF,
            b.BATCH: batch, b.BATCH_CAPACITY: BATCH, b.EDGES: edges, b.EDGES_CAPACITY: capacity,
            b.EDGE_HASHES: prepared, b.EDGE_LABELS: prepared + 8 * capacity,
            b.EDGE_SLOTS: prepared + 16 * capacity,
            b.SOURCE: -1, b.LEVEL_END: roots, b.CONFIGURATIONS: roots,
            b.FAULTS: faults, b.OVERFLOW: -1, b.GROUP_FIRST: small,
        }  # fmt: skip
        for word, value in settings.items():
            block[word] = value
        return block

    # -------------------------------------------------- threads

    def sharing(self) -> Sharing | None:
        """The threads that explore together; None: there is one, or too few nodes for more."""
        from llfsm_verify.kripke.sharing import SMALLEST, Sharing

        if self._sharing is None and self._jobs > 1 and self.chains is None and self.nodes.count >= SMALLEST:
            try:
                self._sharing = Sharing(self._kernels, self._native, self.block, self._jobs)
            except (OutOfMemory, RuntimeError):  # no memory for threads, or none can be started
                self._jobs = 1
        return self._sharing

    def end_sharing(self) -> None:
        """End the threads, until there is something to explore again."""
        if self._sharing is not None:
            self._sharing.close()
            self._sharing = None

    # -------------------------------------------------- room

    def make_room(self, code: int, budget: Budget) -> None:
        """Make room for what a kernel that returned `code` has none for. Raises LimitReached."""
        if code in (b.ROOM_NODES, b.ROOM_EDGES, b.ROOM_LETTERS, b.ROOM_GROUP):
            self._grow(code, budget)
        else:
            self.place()

    @whole
    def _grow(self, code: int, budget: Budget) -> None:
        if code == b.ROOM_NODES:
            self._more_nodes(budget)
        elif code == b.ROOM_EDGES:
            self._edge_limit *= 2
        elif code == b.ROOM_LETTERS:
            self._more_letters(budget)
        else:
            self._more_group(budget)
        self.place()
        self.sound = True

    def _more_nodes(self, budget: Budget) -> None:
        if self.nodes.limit >= MAX_NODES // 2:
            raise LimitReached(f"there are more than {self.nodes.limit} nodes, more than this engine numbers")
        budget.check(self.nodes.table_bytes)
        self.sound = False
        self.nodes.grow(None if self._sharing is None else self._sharing.spread)

    def _more_letters(self, budget: Budget) -> None:
        chains = self.chains
        if chains is not None and chains.is_full:
            chains.check(budget)
        self.sound = False
        if self._letters.count >= self._letters.limit:
            self._letters.grow()
        if chains is not None and chains.is_full:
            chains.grow()

    def _more_group(self, budget: Budget) -> None:
        """A larger table of one configuration's successors."""
        most, block = budget.max_states, self.block
        if most is not None and block[b.GROUP_COUNT] > max(most, 1) * LETTERS_EACH:
            raise LimitReached(reached(most, "configurations"))
        budget.check(4 * self._group_slots * GROUP_SLOT_BYTES)
        self.sound = False
        old, slots = self._group, 4 * self._group_slots
        self._group = Region(slots * GROUP_SLOT_BYTES)
        request = (ctypes.c_int64 * 5)(
            self._group.address, slots - 1, block[b.GENERATION], old.address, self._group_slots
        )  # fmt: skip
        self._kernels.run("regroup", ctypes.addressof(request))
        self._group_slots = slots
        old.close()

    @whole
    def narrow(self, keeps: Callable[[int], bool]) -> bool:
        """Store only edges whose letters `keeps` tells, and of those stored too; false, and nothing has changed, when
        most of these are."""
        from llfsm_verify.kripke.narrow import kept_edges

        graph, block = self._graph, self.block
        found = kept_edges(graph, block[b.SOURCE] + 1, block[b.EDGE_COUNT], keeps)
        if found is None:
            return False
        graph.drop_edges()
        graph.is_narrow, self._keeps = True, keeps
        graph.sources, graph.targets, graph.labels = (Region(1) for _ in range(3))
        for region, column in zip((graph.sources, graph.targets, graph.labels), found, strict=True):
            region.write(column)
        block[b.EDGE_COUNT] = len(found[0]) // NUMBER_BYTES
        self.place()
        self.read_back()
        return True

    def place(self) -> None:
        """Make room as far as the limits say, and tell the kernels where things are: growing memory moves."""
        graph, block = self._graph, self.block
        limit = self.nodes.limit
        graph.parents.grow(limit * NUMBER_BYTES)
        graph.letter_sources.grow(self._letters.limit * NUMBER_BYTES)
        if graph.with_edges:
            graph.first.grow((limit + 1) * FIRST_BYTES)
        if graph.is_narrow:
            graph.sources.grow(self._edge_limit * NUMBER_BYTES)
            self._kept.write(bytes(map(self._keeps, graph.alphabet[block[b.KEPT_LETTERS] :])), block[b.KEPT_LETTERS])
            block[b.KEPT], block[b.KEPT_LETTERS] = self._kept.address, len(graph.alphabet)
        stores = graph.with_edges or graph.is_narrow
        if stores:
            graph.targets.grow(self._edge_limit * NUMBER_BYTES)
            graph.labels.grow(self._edge_limit * NUMBER_BYTES)
        block[b.WITH_EDGES], block[b.LETTER_SOURCES] = int(stores), graph.letter_sources.address
        block[b.PARENTS], block[b.FIRST] = graph.parents.address, graph.first.address
        block[b.SOURCES] = graph.sources.address
        block[b.TARGETS], block[b.LABELS] = graph.targets.address, graph.labels.address
        block[b.EDGE_LIMIT] = self._edge_limit
        block[b.GROUP_TABLE], block[b.GROUP_MASK] = self._group.address, self._group_slots - 1
        block[b.GROUP_LIMIT] = self._group_slots // 4  # a pair takes up to two slots, and half of them stay free

    def read_back(self) -> None:
        """Put what the kernels have found out into the graph."""
        graph, block = self._graph, self.block
        graph.count, graph.expanded = self.nodes.count, block[b.EXPANDED]
        graph.configurations, graph.edge_count = block[b.CONFIGURATIONS], block[b.EDGE_COUNT]
        graph.transitions, graph.depth = block[b.TRANSITIONS], block[b.DEPTH]
        graph.overflow = None if block[b.OVERFLOW] < 0 else block[b.OVERFLOW]
        graph.faults = {fault: node for fault, node in enumerate(self._faults()) if node >= 0}
        width = 8 * self._letters.words
        for label in range(len(graph.alphabet), self._letters.count):
            record = bytes(self._width) + self._letters.keys.read(label * width, width)
            graph.alphabet.append(self._observer.letter(record))
        if self.chains is not None:
            self.chains.read_back()

    def _faults(self) -> array[int]:
        """For each fault, the first node that it happens from, or -1."""
        return array("q", self._scratch[5].read(0, 8 * len(self._program.faults)))

    def close(self) -> None:
        """Give the memory back: the graph's too."""
        for region in (self._group, self._letters.keys, self._kept, *self._scratch):
            region.close()
        if self.chains is not None:
            self.chains.close()
        self.end_sharing()
        self.nodes.close()
        self._letters.close()
        self._graph.close()

    # -------------------------------------------------- checkpoints

    def saved(self) -> tuple[Numbers, list[Section]]:
        """What `restore` needs, between two batches: numbers, and regions with the bytes used of each."""
        block = self.block
        numbers = Numbers(
            nodes=self._graph.count,
            expanded=block[b.EXPANDED],
            letters=self._letters.count,
            words=0 if self.chains is None else self.chains.words.count,
            edges=block[b.EDGE_COUNT],
            transitions=block[b.TRANSITIONS],
            level_end=block[b.LEVEL_END],
            depth=block[b.DEPTH],
            overflow=block[b.OVERFLOW],
            faults=tuple(self._faults()),
        )
        return numbers, self._sections(numbers)

    def _sections(self, numbers: Numbers) -> list[Section]:
        graph = self._graph
        letter_bytes, words = 8 * self._letters.words, [] if self.chains is None else [self.chains.words.keys]
        regions = (graph.keys, graph.parents, graph.first, graph.targets, graph.labels, self._letters.keys, *words)
        return list(zip(regions, sizes(numbers, graph, letter_bytes, with_words=bool(words)), strict=True))

    def restore(self, numbers: Numbers, read: Callable[[Sequence[Section], Budget], None], budget: Budget) -> None:
        """Go back to what `saved` gave; `read` puts the bytes into the regions.

        Raises Unusable for what `saved` cannot have given, LimitReached. These tables must then not be used any more.
        """
        from llfsm_verify.kripke.restoring import Memory

        graph, block = self._graph, self.block
        self.sound = False
        roots = graph.keys.read(0, graph.roots * graph.words * 8)
        words = None if self.chains is None else self.chains.words
        read(self._sections(numbers), budget)
        trie = None if words is None else words.keys
        memory = Memory(graph, self._native.layout, roots, self._letters.keys, self._observer.mask(), trie)
        configurations = memory.check(numbers, budget)
        distinct = self.nodes.restore(numbers.nodes) and self._letters.restore(numbers.letters)
        if not distinct or not (words is None or words.restore(numbers.words)):
            raise Unusable("it is damaged")
        values = {
            b.EXPANDED: numbers.expanded, b.EDGE_COUNT: numbers.edges, b.SOURCE: numbers.expanded - 1,
            b.LEVEL_END: numbers.level_end, b.DEPTH: numbers.depth, b.TRANSITIONS: numbers.transitions,
            b.CONFIGURATIONS: configurations, b.OVERFLOW: numbers.overflow,
        }  # fmt: skip
        for word, value in values.items():
            block[word] = value
        self._scratch[5].write(array("q", numbers.faults).tobytes())
        while self._edge_limit < 2 * numbers.edges:
            self._edge_limit *= 2
        if self.chains is not None:
            self.chains.is_restored = True
        self.place()
        self.read_back()
        self.sound = True
