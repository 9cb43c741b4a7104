"""Searches of the product of a graph and an automaton, as Python calls them: memory for the kernels, and its growth.

The automaton is given by numbers only: states 0, 1, … and moves that are asked for when a kernel first needs them.
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import TracebackType
from typing import Self

from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.explore import LimitReached
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.memory import Region

Move = tuple[int, int]
"""A move of an automaton: its target, and the mask of the acceptance sets it is in."""
ProductNode = tuple[int, int]
"""A node of the graph and a state of the automaton."""

MAX_SETS = 62
"""Acceptance sets that fit the kernels' words."""
TICK_WORK = 256
"""Edges for which `tick` is called once."""


ENTER_WORK = 1 << 20
"""Product nodes entered into a table, labels or places looked through, in one call."""


class ProductTooLarge(LimitReached):
    """A search found more product nodes than it can number."""

    def __init__(self) -> None:
        super().__init__(f"the product of the arrangement and a property has more than {p.MOST_NODES:,} nodes")


@dataclass(frozen=True, slots=True)
class Sizes:
    """How much room a search begins with, and when it does what; tests make everything small."""

    portion: int = 1 << 20
    """Edges that a kernel takes before it returns."""
    entries: int = 1 << 12
    """Product nodes on stacks and in queues; they double."""
    slots: int = 1 << 12
    """Slots of the table of a sparse store, a power of two; they double."""
    dense_bytes: int = 1 << 28
    dense_states: int = 16
    """A store is dense while it has at most so many bytes, or at most so many states of the automaton."""


SIZES = Sizes()


class Rows:
    """The moves of an automaton by state and class of letters, in memory for the kernels.

    Letters of the same `classify` are one class; ``step(state, letter)`` gives the moves for any letter of the class.
    States are numbered without gaps, by `step` itself. An edge that shows no letter leaves the automaton where it is.
    """

    def __init__(
        self, graph: Graph, classify: Callable[[int], Hashable], step: Callable[[int, int], Iterable[Move]]
    ) -> None:
        self._graph, self._classify, self._step = graph, classify, step
        numbers: dict[Hashable, int] = {}
        self._letters: list[int] = []
        classes = array("I")
        for letter in graph.alphabet:
            kind = classify(letter)
            number = numbers.setdefault(kind, len(numbers))
            if number == len(self._letters):
                self._letters.append(letter)
            classes.append(number)
        self.stride = len(self._letters) + 1
        self.states = 1
        """States numbered so far."""
        self._offsets: dict[tuple[Move, ...], int] = {}
        self._used = 1
        self.classes, self.rows, self.moves = Region(1), Region(4 * self.stride), Region(8)
        self.classes.write(classes.tobytes())

    def of(self, step: Callable[[int, int], Iterable[Move]]) -> Rows:
        """Rows of another automaton for the same classes of letters."""
        return Rows(self._graph, self._classify, step)

    def fill(self, state: int, letter_class: int) -> None:
        """Compute a missing row."""
        silent = letter_class == self.stride - 1
        row = ((state, 0),) if silent else tuple(self._step(state, self._letters[letter_class]))
        offset = self._offsets.get(row)
        if offset is None:
            offset = self._offsets[row] = self._used
            words = array("q", [len(row)])
            for target, acceptance in row:
                words.extend((target, acceptance))
            self.moves.write(words.tobytes(), 8 * offset)
            self._used += len(words)
            self.reserve(max((target for target, _ in row), default=0))
        ctypes.c_uint32.from_address(self.rows.address + 4 * (state * self.stride + letter_class)).value = offset

    def reserve(self, state: int) -> None:
        """Make room for the rows of a state."""
        self.states = max(self.states, state + 1)
        if self.states * self.stride * 4 > self.rows.size:
            self.rows.grow(2 * self.states * self.stride * 4)

    def close(self) -> None:
        for region in (self.classes, self.rows, self.moves):
            region.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


class _Search:
    """What the searches share: the control block, the store of the product nodes found, and calling until done."""

    kernel: str

    def __init__(self, graph: Graph, rows: Rows, tick: Callable[[], None], sizes: Sizes, words: int) -> None:
        self._graph = graph
        self._rows = rows
        self._tick = tick
        self._sizes = sizes
        self._block = (ctypes.c_int64 * words)()
        self._ticked = 0
        self._marks, self._keys, self._slots = Region(1), Region(1), Region(1)
        self._sparse = 0
        """Slots of the table; 0: the store is dense."""
        b = self._block
        b[p.FIRST], b[p.TARGETS], b[p.LABELS] = graph.first.address, graph.targets.address, graph.labels.address
        b[p.EXPANDED], b[p.NODES] = graph.expanded, len(graph)
        b[p.CLASSES], b[p.STRIDE] = rows.classes.address, rows.stride

    @property
    def work(self) -> int:
        """Edges taken so far."""
        return self._block[p.DONE_WORK]

    @property
    def found(self) -> int:
        """Product nodes found so far."""
        return self._block[p.COUNT]

    @property
    def block(self) -> ctypes.Array[ctypes.c_int64]:
        return self._block

    def _run(self, most: int | None = None) -> int:
        """Go on until the kernel says DONE or FOUND, or until `most` more edges have been taken (PORTION)."""
        b = self._block
        self._fit()
        end = None if most is None else self.work + max(most, 0)
        while True:
            b[p.ROWS], b[p.MOVES] = self._rows.rows.address, self._rows.moves.address
            b[p.MARKS], b[p.KEYS] = self._marks.address, self._keys.address
            portion = self._sizes.portion
            b[p.WORK] = portion if end is None else min(portion, end - self.work)
            code = kernels().run(self.kernel, ctypes.addressof(b))
            self._spend(self.work - self._ticked)
            self._ticked = self.work
            if code == p.NEED:
                self._rows.fill(b[p.NEED_STATE], b[p.NEED_CLASS])
                self._fit()
            elif code == p.GROW:
                self._grow()
            elif code != p.PORTION:
                return code
            if end is not None and self.work >= end:
                return p.PORTION

    def _spend(self, work: int) -> None:
        for _ in range(-(-work // TICK_WORK)):
            self._tick()

    def _in_portions(self, kernel: str, end: int) -> int:
        """Call a kernel for all of 0 … end - 1; its results, joined."""
        b, joined = self._block, 0
        for begin in range(0, end, ENTER_WORK):
            b[p.ENTER_BEGIN], b[p.ENTER_END] = begin, min(begin + ENTER_WORK, end)
            joined |= kernels().run(kernel, ctypes.addressof(b))
            self._spend(b[p.ENTER_END] - begin)
        return joined

    def _fit(self) -> None:
        """Room in the store for every state of the automaton that there is now."""
        if self._sparse:
            return
        size = self._dense_size(self._rows.states)
        if size > self._sizes.dense_bytes and self._rows.states > self._sizes.dense_states:
            self._thin()
        elif size > self._marks.size:
            self._marks.grow(size if not self.found else 2 * size)

    def _more_slots(self) -> None:
        """A sparse store of twice as many slots, at least those for all product nodes found."""
        slots = max(2 * self._sparse, self._sizes.slots)
        while slots // 2 <= self.found:
            slots *= 2
        larger = Region(4 * slots)
        self._slots.close()
        self._slots = larger
        self._sparse = slots
        b = self._block
        b[p.SLOTS], b[p.SHIFT], b[p.CAPACITY] = larger.address, 65 - slots.bit_length(), slots // 2
        if b[p.CAPACITY] > p.MOST_NODES:
            raise ProductTooLarge

    def _rehash(self) -> None:
        self._block[p.KEYS], self._block[p.MARKS] = self._keys.address, self._marks.address
        self._in_portions("product_rehash", self.found)

    def _dense_size(self, states: int) -> int:
        """Bytes of a dense store."""
        raise NotImplementedError

    def _thin(self) -> None:
        """Go over from the dense store to a sparse one."""
        raise NotImplementedError

    def _grow(self) -> None:
        """Make room for more product nodes."""
        raise NotImplementedError

    def _regions(self) -> tuple[Region, ...]:
        return self._marks, self._keys, self._slots

    def close(self) -> None:
        for region in self._regions():
            region.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def _packed(nodes: Iterable[ProductNode]) -> array[int]:
    return array("q", (state << 32 | node for node, state in nodes))


class Components(_Search):
    """The search for a component of the product that can be reached and has edges of all acceptance sets inside.

    Memory for each product node found: 4 bytes in a dense store (times the states of the automaton that a node is not
    found with), 20 to 28 in a sparse one; 8 more while its component is open, 16 while it is on the search path, 24 for
    each component on it.
    """

    kernel = "product_components"

    def __init__(self, graph: Graph, rows: Rows, sets: int, tick: Callable[[], None], sizes: Sizes = SIZES) -> None:
        """`sets` acceptance sets, at most MAX_SETS."""
        if not 0 <= sets <= MAX_SETS:
            raise ValueError(f"{sets} acceptance sets")
        super().__init__(graph, rows, tick, sizes, p.EMPTINESS_WORDS)
        self._starts, self._active, self._path, self._roots = Region(1), Region(1), Region(1), Region(1)
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
        self._begin(starts)
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

    def _begin(self, starts: Sequence[ProductNode]) -> None:
        b = self._block
        keys = _packed(starts)
        self._rows.reserve(max((state for _, state in starts), default=0))
        self._starts.write(keys.tobytes())
        b[p.STARTS], b[p.START_COUNT], b[p.STARTED] = self._starts.address, len(keys), 0

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
            raise ProductTooLarge
        b = self._block
        self._entries = entries
        self._active.grow(8 * entries)
        self._path.grow(16 * entries)
        self._roots.grow(24 * entries)
        b[p.ACTIVE], b[p.PATH], b[p.ROOTS] = self._active.address, self._path.address, self._roots.address
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
            b[p.STARTS] = dense.address
            self._in_portions("product_thin", size)
            b[p.STARTS] = self._starts.address
        finally:
            dense.close()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._starts, self._active, self._path, self._roots


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a path: the product node it leads to, and the letter of the edge; None: it shows none."""

    letter: int | None
    target: ProductNode


class Breadth(_Search):
    """Breadth-first search for product nodes, nearest first; distances are counted in letters.

    Memory for each product node found: 12 bytes, and in a dense store a bit (for each state of the automaton), in a
    sparse one 8 to 16 bytes.
    """

    kernel = "product_breadth"

    def __init__(
        self,
        graph: Graph,
        rows: Rows,
        starts: Iterable[ProductNode],
        tick: Callable[[], None],
        *,
        goal: ProductNode | Components | None = None,
        within: tuple[Components, Sequence[int]] | None = None,
        limit: int | None = None,
        sizes: Sizes = SIZES,
    ) -> None:
        """`goal`: the product nodes to look for: this one (which must not be a start); those that the components'
        search has marked; None: the targets of moves with acceptance. `within`: only nodes so marked are visited,
        where the sequence gives the state of the components' search for each state here; it may grow. `limit`: the
        largest distance looked at.
        """
        super().__init__(graph, rows, tick, sizes, p.BREADTH_WORDS)
        self._parents, self._bases = Region(1), Region(1)
        self._base_states: Sequence[int] = ()
        self.exhausted = False
        """There is no other goal."""
        self._based = 0
        b = self._block
        b[p.EPSILONS] = b[p.SILENT] = self._in_portions("product_silent", graph.edge_count)
        b[p.DEPTH_LIMIT] = -1 if limit is None else limit
        other: Components | None = None
        if isinstance(goal, Components):
            b[p.GOAL], other = p.MARKED, goal
        elif goal is not None:
            b[p.GOAL], b[p.WANTED] = p.EXACTLY, goal[1] << 32 | goal[0]
        else:
            b[p.GOAL] = p.ANY_FLAGGED
        if within is not None:
            other, self._base_states = within
            b[p.WITHIN] = 1
        if other is not None:
            source = other.block
            b[p.OTHER_MARKS], b[p.OTHER_SLOTS] = source[p.MARKS], source[p.SLOTS]
            b[p.OTHER_SHIFT], b[p.OTHER_KEYS] = source[p.SHIFT], source[p.KEYS]
            b[p.OTHER_STATES] = other.states
        self._enter(starts)

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

    def path(self, number: int) -> tuple[ProductNode, list[Step]]:
        """A shortest path to a product node: the start, and the steps."""
        numbers = [number]
        while (parent := self._parent(numbers[-1])) != numbers[-1]:
            numbers.append(parent)
        numbers.reverse()
        nodes = [self.node(n) for n in numbers]
        return nodes[0], [Step(self._letter(source, target), target) for source, target in pairwise(nodes)]

    def _letter(self, source: ProductNode, target: ProductNode) -> int | None:
        b = (ctypes.c_int64 * p.EDGE_WORDS)(*self._block[: p.SHARED_WORDS])
        b[p.ROWS], b[p.MOVES] = self._rows.rows.address, self._rows.moves.address
        b[p.EDGE_FROM], b[p.EDGE_TO] = _packed((source, target))
        kernels().run("product_edge", ctypes.addressof(b))
        assert b[p.EDGE_FOUND] >= 0, "a step of a path is no edge of the product"
        label = ctypes.c_uint32.from_address(self._graph.labels.address + 4 * b[p.EDGE_FOUND]).value
        return None if label == p.EPSILON else self._graph.alphabet[label]

    def _parent(self, number: int) -> int:
        return ctypes.c_uint32.from_address(self._parents.address + 4 * number).value

    def _enter(self, starts: Iterable[ProductNode]) -> None:
        """Put the starts into the queue; each is its own parent."""
        distinct = dict.fromkeys(starts)
        keys = _packed(distinct)
        self._rows.reserve(max((state for _, state in distinct), default=0))
        b = self._block
        self._keys.write(keys.tobytes())
        self._parents.write(array("I", range(len(keys))).tobytes())
        self._grow_queue(max(len(keys) + 1, self._sizes.entries))
        self._fit()
        b[p.COUNT] = b[p.START_COUNT] = b[p.LAYER_END] = len(keys)
        if self._sparse:
            self._more_slots()
        self._rehash()

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
            raise ProductTooLarge
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
        return *super()._regions(), self._parents, self._bases
