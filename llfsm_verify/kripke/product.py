"""What searches of the product of a graph and an automaton share: rows of moves, stores of product nodes, growth.

The automaton is given by numbers only: states 0, 1, … and moves that are asked for when a kernel first needs them. It
reads the labels of the graph (letters, or words of them) by classes: divided by what of them matters to it.
"""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from llfsm_verify.files import Closing
from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.graph import NO_PREFIX, Graph
from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.memory import Region
from llfsm_verify.limits import LimitReached, tick

Move = tuple[int, int]
"""A move of an automaton: its target, and the mask of the acceptance sets it is in."""
WORDS_DIVIDED = 1 << 16
"""Words divided into classes between two looks at the limits."""


class LabelClasses:
    """The labels of a graph, divided: by the classes of their letters, in order.

    Class c of a graph without chains is that of ``letters[c]``. Else it is that of the words of class
    ``prefixes[c]`` (-1: the empty word) followed by a letter of the class of ``letters[last[c]]``.
    """

    def __init__(self, graph: Graph, bits: int) -> None:
        """Letters that agree in all `bits`, a mask, are one class."""
        numbers: dict[int, int] = {}
        of_letter = array("I", (numbers.setdefault(letter & bits, len(numbers)) for letter in graph.alphabet))
        self.letters: list[int] = []
        """A letter of each class of letters."""
        for letter, number in zip(graph.alphabet, of_letter, strict=True):
            if number == len(self.letters):
                self.letters.append(letter)
        self.prefixes, self.last = array("q", [-1]) * len(self.letters), array("I", range(len(self.letters)))
        self.of_label = of_letter
        if graph.sequences is not None:
            self.prefixes, self.last, self.of_label = array("q"), array("I"), array("I")
            self._divide(graph.sequences.pairs(), of_letter)

    def __len__(self) -> int:
        return len(self.last)

    def _divide(self, pairs: array[int], of_letter: array[int]) -> None:
        numbers: dict[int, int] = {}
        of_word = self.of_label
        for word, pair in enumerate(pairs):
            prefix, last = pair >> 32, of_letter[pair & NO_PREFIX]
            before = -1 if prefix == NO_PREFIX else of_word[prefix]
            number = numbers.setdefault((before + 1) << 32 | last, len(numbers))
            if number == len(self.last):
                self.prefixes.append(before)
                self.last.append(last)
            of_word.append(number)
            if word % WORDS_DIVIDED == 0:
                tick()


class Reading:
    """The moves of an automaton, given letter by letter, with whole labels."""

    def __init__(
        self,
        classes: LabelClasses,
        step: Callable[[int, int], Iterable[Move]],
        ends: Callable[[int], bool] | None = None,
    ) -> None:
        """``step(state, letter)`` gives the moves with the letters of a class, for any letter of it. There are no moves
        from states that `ends` tells, but inside a word it is read on from them."""
        self._classes = classes
        self._step = step
        self._ends = ends
        self._known: dict[tuple[int, int], tuple[Move, ...]] = {}

    def __call__(self, state: int, label_class: int) -> tuple[Move, ...]:
        """(target, acceptance) of each way to read a label of a class: the acceptance of all its letters, joined."""
        if self._ends is not None and self._ends(state):
            return ()
        classes, rest = self._classes, []
        if classes.prefixes[label_class] < 0:
            return tuple(self._step(state, classes.letters[classes.last[label_class]]))
        before: tuple[Move, ...] | None = None
        while before is None and label_class >= 0:
            before = self._known.get((state, label_class))
            if before is None:
                rest.append(label_class)
                label_class = classes.prefixes[label_class]
        moves = before if before is not None else ((state, 0),)
        for number in reversed(rest):
            moves = self._known[state, number] = self._extended(moves, classes.letters[classes.last[number]])
        return moves

    def _extended(self, moves: tuple[Move, ...], letter: int) -> tuple[Move, ...]:
        """One letter more; without moves that one to the same state, in more acceptance sets, makes needless."""
        best: dict[int, list[int]] = {}
        for middle, before in moves:
            for target, acceptance in self._step(middle, letter):
                mask, masks = before | acceptance, best.setdefault(target, [])
                if not any(mask & ~known == 0 for known in masks):
                    masks[:] = [known for known in masks if known & ~mask]
                    masks.append(mask)
        return tuple((target, mask) for target, masks in best.items() for mask in masks)


Block = ctypes.Array[ctypes.c_int64]
ProductNode = tuple[int, int]
"""A node of the graph and a state of the automaton."""

NO_STATE = p.NO_STATE
"""A state of one automaton has no counterpart in another."""
MAX_SETS = 62
"""Acceptance sets that fit the kernels' words."""
TICK_WORK = 256
"""Edges for which `tick` is called once."""
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


def _spend(work: int) -> None:
    for _ in range(-(-work // TICK_WORK)):
        tick()


def in_portions(kernel: str, block: Block, end: int) -> int:
    """Call a kernel for all of 0 … end - 1; its results, joined."""
    joined = 0
    for begin in range(0, end, ENTER_WORK):
        block[p.ENTER_BEGIN], block[p.ENTER_END] = begin, min(begin + ENTER_WORK, end)
        joined |= kernels().run(kernel, ctypes.addressof(block))
        _spend(block[p.ENTER_END] - begin)
    return joined


class EdgeClasses(LabelClasses):
    """The labels of a graph, divided, and whether there are edges without one."""

    def __init__(self, graph: Graph, bits: int) -> None:
        """Letters that agree in all `bits`, a mask, are one class."""
        super().__init__(graph, bits)
        block = (ctypes.c_int64 * p.SHARED_WORDS)()
        block[p.LABELS] = graph.labels.address
        self.silent = bool(in_portions("product_silent", block, graph.edge_count))
        """There are edges that show no letter."""


class Rows(Closing):
    """The moves of an automaton by state and class of labels, in memory for the kernels.

    ``step(state, letter)`` gives the moves with the letters of a class, for any letter of it. States are numbered
    without gaps, by `step` itself. An edge that shows no letter leaves the automaton where it is. From states that
    `ends` tells no edge is taken.
    """

    def __init__(
        self,
        classes: EdgeClasses,
        step: Callable[[int, int], Iterable[Move]],
        ends: Callable[[int], bool] | None = None,
        read: Callable[[int, int], tuple[Move, ...]] | None = None,
    ) -> None:
        """`read`: the moves by state and class, in place of what `step` makes of the letters of a word."""
        self._reading = read or Reading(classes, step, ends)
        self.silent = classes.silent
        self.stride = len(classes) + 1
        self.states = 1
        """States numbered so far."""
        self._offsets: dict[tuple[Move, ...], int] = {}
        self._used = 1
        self.classes, self.rows, self.moves = (Region(1), Region(4 * self.stride), Region(8))
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


class ProductSearch(Closing):
    """What the searches share: the control block, the store of the product nodes found, and calling until done."""

    kernel: str

    def __init__(self, graph: Graph, rows: Rows, sizes: Sizes, words: int) -> None:
        self._graph = graph
        self._rows = rows
        self._sizes = sizes
        self._block = (ctypes.c_int64 * words)()
        self._ticked = 0
        self._marks, self._keys, self._slots = Region(1), Region(1), Region(1)
        self._sparse = 0
        """Slots of the table; 0: the store is dense."""
        b = self._block
        b[p.FIRST], b[p.TARGETS], b[p.LABELS] = (graph.first.address, graph.targets.address, graph.labels.address)
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
            _spend(self.work - self._ticked)
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
        b[p.SLOTS], b[p.SHIFT], b[p.CAPACITY] = (larger.address, 65 - slots.bit_length(), slots // 2)
        if b[p.CAPACITY] > p.MOST_NODES:
            raise ProductTooLarge(TOO_MANY_NODES)

    def _rehash(self) -> None:
        self._block[p.KEYS], self._block[p.MARKS] = (self._keys.address, self._marks.address)
        in_portions("product_rehash", self._block, self.found)

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


def packed(nodes: Iterable[ProductNode]) -> array[int]:
    return array("q", (state << 32 | node for node, state in nodes))
