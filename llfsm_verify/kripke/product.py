"""Searches of the product of a graph and an automaton, as Python calls them: memory for the kernels, and its growth.

The automaton is given by numbers only: states 0, 1, … and moves that are asked for when a kernel first needs them.
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from types import TracebackType
from typing import Self

from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.explore import LimitReached
from llfsm_verify.kripke.graph import Graph, Letters
from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.reading import LabelClasses, Move, Reading

Tick = Callable[[], None]
Block = ctypes.Array[ctypes.c_int64]
ProductNode = tuple[int, int]
"""A node of the graph and a state of the automaton."""

NO_STATE = p.NO_STATE
"""A state of one automaton has no counterpart in another."""
MAX_SETS = 62
"""Acceptance sets that fit the kernels' words."""
TICK_WORK = 256
"""Edges for which `tick` is called once."""


CLEARED_BYTES = 1 << 16
"""Larger memory is not cleared, but given back and asked for anew."""
ENTER_WORK = 1 << 20
"""Product nodes entered into a table, labels or places looked through, in one call."""


TOO_MANY_NODES = f"the product of the arrangement and a property has more than {p.MOST_NODES:,} nodes"


class ProductTooLarge(LimitReached):
    """A product has more than the kernels can number."""


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
    rows: int = 20_000
    """Rows of moves that are looked at to learn which states of the automaton matter."""


SIZES = Sizes()


def _spend(work: int, tick: Tick) -> None:
    for _ in range(-(-work // TICK_WORK)):
        tick()


def _in_portions(kernel: str, block: Block, end: int, tick: Tick) -> int:
    """Call a kernel for all of 0 … end - 1; its results, joined."""
    joined = 0
    for begin in range(0, end, ENTER_WORK):
        block[p.ENTER_BEGIN], block[p.ENTER_END] = begin, min(begin + ENTER_WORK, end)
        joined |= kernels().run(kernel, ctypes.addressof(block))
        _spend(block[p.ENTER_END] - begin, tick)
    return joined


class Classes(LabelClasses):
    """The labels of a graph, divided, and whether there are edges without one."""

    def __init__(self, graph: Graph, classify: Callable[[int], Hashable], tick: Tick) -> None:
        """Letters of the same `classify` are one class."""
        super().__init__(graph, classify, tick)
        block = (ctypes.c_int64 * p.SHARED_WORDS)()
        block[p.LABELS] = graph.labels.address
        self.silent = bool(_in_portions("product_silent", block, graph.edge_count, tick))
        """There are edges that show no letter."""


class Rows:
    """The moves of an automaton by state and class of labels, in memory for the kernels.

    ``step(state, letter)`` gives the moves with the letters of a class, for any letter of it. States are numbered
    without gaps, by `step` itself. An edge that shows no letter leaves the automaton where it is. From states that
    `ends` tells no edge is taken.
    """

    def __init__(
        self,
        classes: Classes,
        step: Callable[[int, int], Iterable[Move]],
        ends: Callable[[int], bool] | None = None,
    ) -> None:
        self._reading = Reading(classes, step, ends)
        self.silent = classes.silent
        self.stride = len(classes) + 1
        self.states = 1
        """States numbered so far."""
        self._offsets: dict[tuple[Move, ...], int] = {}
        self._used = 1
        self.classes, self.rows, self.moves = (
            Region(1),
            Region(4 * self.stride),
            Region(8),
        )
        self.classes.write(classes.of_label.tobytes())

    def fill(self, state: int, label_class: int) -> None:
        """Compute a missing row."""
        silent = label_class == self.stride - 1
        row = ((state, 0),) if silent else self._reading(state, label_class)
        offset = self._offsets.get(row)
        if offset is None:
            if len(row) > p.MOST_MOVES:
                raise ProductTooLarge(f"an automaton of a property has more than {p.MOST_MOVES:,} moves from one state")
            offset = self._offsets[row] = self._used
            words = array("q", [len(row)])
            for target, acceptance in row:
                words.extend((target, acceptance))
            self.moves.write(words.tobytes(), 8 * offset)
            self._used += len(words)
            self.reserve(max((target for target, _ in row), default=0))
        ctypes.c_uint32.from_address(self.rows.address + 4 * (state * self.stride + label_class)).value = offset

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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()


class _Search:
    """What the searches share: the control block, the store of the product nodes found, and calling until done."""

    kernel: str

    def __init__(self, graph: Graph, rows: Rows, tick: Tick, sizes: Sizes, words: int) -> None:
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
        b[p.FIRST], b[p.TARGETS], b[p.LABELS] = (
            graph.first.address,
            graph.targets.address,
            graph.labels.address,
        )
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
    def block(self) -> Block:
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
            _spend(self.work - self._ticked, self._tick)
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

    def _fit(self) -> None:
        """Room in the store for every state of the automaton that there is now."""
        if self._sparse:
            return
        size = self._dense_size(self._rows.states)
        if size > self._sizes.dense_bytes and self._rows.states > self._sizes.dense_states:
            self._thin()
        elif size > self._marks.size:
            self._marks.grow(size if not self.found else 2 * size)

    def _more_slots(self, room: int = 1) -> None:
        """A sparse store of twice as many slots, with room for that many more product nodes; still empty."""
        slots = max(2 * self._sparse, self._sizes.slots)
        while slots // 2 < self.found + room:
            slots *= 2
        larger = Region(4 * slots)
        self._slots.close()
        self._slots = larger
        self._sparse = slots
        b = self._block
        b[p.SLOTS], b[p.SHIFT], b[p.CAPACITY] = (
            larger.address,
            65 - slots.bit_length(),
            slots // 2,
        )
        if b[p.CAPACITY] > p.MOST_NODES:
            raise ProductTooLarge(TOO_MANY_NODES)

    def _rehash(self) -> None:
        self._block[p.KEYS], self._block[p.MARKS] = (
            self._keys.address,
            self._marks.address,
        )
        _in_portions("product_rehash", self._block, self.found, self._tick)

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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()


def _cleared(region: Region) -> Region:
    """The region with zeros everywhere, or another one instead of it."""
    if region.size > CLEARED_BYTES:
        region.close()
        return Region(region.size)
    ctypes.memset(region.address, 0, region.size)
    return region


def _packed(nodes: Iterable[ProductNode]) -> array[int]:
    return array("q", (state << 32 | node for node, state in nodes))


class Components(_Search):
    """The search for a component of the product that can be reached and has edges of all acceptance sets inside.

    Memory for each product node found: 4 bytes in a dense store (times the states of the automaton that a node is not
    found with), 20 to 28 in a sparse one; 8 more while its component is open, 16 while it is on the search path, 24 for
    each component on it.
    """

    kernel = "product_components"

    def __init__(self, graph: Graph, rows: Rows, sets: int, tick: Tick, sizes: Sizes = SIZES) -> None:
        """`sets` acceptance sets, at most MAX_SETS."""
        if not 0 <= sets <= MAX_SETS:
            raise ValueError(f"{sets} acceptance sets")
        super().__init__(graph, rows, tick, sizes, p.EMPTINESS_WORDS)
        self._starts, self._active, self._path, self._roots = (
            Region(1),
            Region(1),
            Region(1),
            Region(1),
        )
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
        self._starts.write(_packed(starts).tobytes())
        self._block[p.STARTS], self._block[p.START_COUNT] = (
            self._starts.address,
            len(starts),
        )
        self._block[p.STARTED] = self._block[p.START_STATES] = 0
        return self._run() == p.FOUND

    def search_found(self, reached: Breadth, states: Sequence[int]) -> bool:
        """The same from all product nodes that another search has found; from those that it has found since the last
        call. `states` are the states here for those there, or NO_STATE; product nodes with such are passed over."""
        self._rows.reserve(max((state for state in states if state != NO_STATE), default=0))
        self._starts.write(array("I", states).tobytes())
        self._block[p.STARTS], self._block[p.START_COUNT] = (
            reached.block[p.KEYS],
            reached.found,
        )
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
        b[p.ACTIVE], b[p.PATH], b[p.ROOTS] = (
            self._active.address,
            self._path.address,
            self._roots.address,
        )
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
            _in_portions("product_thin", b, size, self._tick)
            b[p.STARTS] = starts
        finally:
            dense.close()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._starts, self._active, self._path, self._roots


class Goal(Enum):
    """Product nodes to look for, unless it is a certain one."""

    NOTHING = p.NOTHING
    """None: all that can be reached is."""
    FLAGGED = p.FLAGGED
    """The targets of moves with acceptance."""
    ACCEPTING = p.MARKED
    """Those in the accepting components that a search for such has found."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a path: the product node it leads to, and what the edge shows."""

    letter: Letters
    target: ProductNode


class Breadth(_Search):
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
        tick: Tick,
        *,
        goal: ProductNode | Goal,
        marks: tuple[Components, Sequence[int] | None] | None = None,
        within: bool = False,
        limit: int | None = None,
        sizes: Sizes = SIZES,
    ) -> None:
        """`goal`: the product nodes to look for; one of them must not be a start. `marks`: a search for components that
        has ended, with its state for each state here, or NO_STATE (None: the same); the sequence may grow. `within`:
        only product nodes in the accepting components found there are visited. `limit`: the largest distance.
        """
        super().__init__(graph, rows, tick, sizes, p.BREADTH_WORDS)
        self._parents, self._bases = Region(1), Region(1)
        self._base_states: Sequence[int] = ()
        self._starts = Region(1)
        self.exhausted = False
        """There is no other goal."""
        self._based = 0
        b = self._block
        b[p.EPSILONS] = rows.silent
        b[p.DEPTH_LIMIT] = -1 if limit is None else limit
        if isinstance(goal, Goal):
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
        """Search from these, too, when there is no other goal; distances are now those from the new ones."""
        keys = _packed(starts)
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

    def path(self, number: int) -> tuple[ProductNode, list[Step]]:
        """A shortest path to a product node: the start, and the steps."""
        numbers = [number]
        while (parent := self._parent(numbers[-1])) != numbers[-1]:
            numbers.append(parent)
        numbers.reverse()
        nodes = [self.node(n) for n in numbers]
        return nodes[0], [Step(self._letter(source, target), target) for source, target in pairwise(nodes)]

    def _letter(self, source: ProductNode, target: ProductNode) -> Letters:
        b = (ctypes.c_int64 * p.EDGE_WORDS)(*self._block[: p.SHARED_WORDS])
        b[p.ROWS], b[p.MOVES] = self._rows.rows.address, self._rows.moves.address
        b[p.EDGE_FROM], b[p.EDGE_TO] = _packed((source, target))
        kernels().run("product_edge", ctypes.addressof(b))
        assert b[p.EDGE_FOUND] >= 0, "a step of a path is no edge of the product"
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
