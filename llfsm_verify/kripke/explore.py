"""Breadth-first exploration of a step program by the kernels."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from time import perf_counter

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.code import BROKEN, OVERFLOW
from llfsm_verify.backends.context import SOURCE
from llfsm_verify.backends.layout import TooManyInitial
from llfsm_verify.backends.native import Edge, NativeProgram
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.kripke.allowance import Allowance, LimitReached
from llfsm_verify.kripke.chains import Chains
from llfsm_verify.kripke.compiled import Kernels, kernels
from llfsm_verify.kripke.graph import FIRST_BYTES, MAX_NODES, NUMBER_BYTES, Graph, Letters
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.vectors import VectorSet
from llfsm_verify.semantics.program import Program

__all__ = ["Allowance", "Explorer", "LimitReached", "Move", "observed_outputs"]

BATCH = 64
"""Configurations expanded in one call of the step program."""
BUFFER_BYTES = 1 << 15
"""About what the buffer of their successors takes: it should stay in the first-level cache."""
FIRST_PORTION, LARGEST_PORTION = 1 << 12, 1 << 19
"""Steps in the first and in later calls of the kernel; the largest takes some hundredths of a second."""
FIRST_EDGES = 1 << 12
"""Edges for which there is room in the beginning."""
FIRST_GROUP = 1 << 12
"""Slots of the table of one configuration's successors, in the beginning."""
GROUP_SLOT_BYTES = 16
MAX_ROOTS = 1 << 20
MAX_STEPS = 1 << 24
"""Steps from one configuration: inputs wider than this are not for enumeration."""
SAMPLE = 2_000
"""Nodes that are looked at to tell whether chains are worth while."""
LETTERS_EACH = 64
"""Successors of one configuration, with different letters, that may stand for one configuration more."""


_SAVED = (
    b.EXPANDED, b.EDGE_COUNT, b.SOURCE, b.LEVEL_END, b.DEPTH, b.TRANSITIONS, b.CONFIGURATIONS, b.OVERFLOW, b.GENERATION
)  # fmt: skip
"""The words of the control block that a checkpoint keeps."""


@dataclass(frozen=True, slots=True)
class Move:
    """One ringlet (`process` None: the stutter) with the values of the choices it read."""

    process: int | None
    choices: dict[str, int]


def observed_outputs(program: Program) -> tuple[tuple[str, str], ...]:
    """What letters show, as (name, output variable): the atoms in order, then what fairness asks about."""
    fair = [name for f in program.fairness for name in (f.premise, f.goal) if name is not None]
    return (*((a.name, a.output) for a in program.atoms), *((name, name) for name in fair))


class Explorer:
    """Explores one program into a `Graph`, in portions; witnesses of its edges are found again when asked for.

    With ``observe: cycle`` the graph's nodes are also the records in the middle of cycles (see `Graph`).
    `with_edges` False: only configurations are stored, as much as faults and counts need. `chains`: configurations with
    one step only are passed over, and an edge shows a word of letters; not with ``observe: cycle``.
    """

    def __init__(
        self,
        program: Program,
        allowance: Allowance,
        report: Callable[[Graph], None] | None = None,
        *,
        with_edges: bool = True,
        chains: bool = False,
    ) -> None:
        """Raises ValueError for chains where whole cycles are observed."""
        if chains and program.observe == "cycle":
            raise ValueError("there are no chains of whole cycles")
        self.program = program
        self._allowance = allowance
        self._report = report
        self._native = NativeProgram(program)
        layout = self._layout = self._native.layout
        self._cycles = program.observe == "cycle"
        self._width = layout.configuration_bytes
        self._fresh = layout.encode_outputs(layout.initial_outputs())
        self._record_words = layout.words + layout.output_words
        words = self._record_words if self._cycles else layout.words
        self.graph = Graph(words, self._width, with_edges or self._cycles, self._fresh if self._cycles else b"")
        self.graph.has_silent_edges = self._cycles
        names = observed_outputs(program)
        self.observed = tuple(name for name, _ in names)
        self._readers = [layout.reader(output) for _, output in names]
        self._cycle = layout.reader(program.cycle)
        self._portion = FIRST_PORTION
        self._goal = 0
        self._sound = True
        """Nothing was interrupted in the middle of a change."""
        self._kernels: Kernels | None = None
        self._with_chains = chains
        self._chains: Chains | None = None
        self._counted = False
        roots = self._roots()
        try:
            self.first_letters = tuple(self._first_letter(root) for root in roots)
            """The letter c0 of each root."""
        except OverflowError:
            self.first_letters = ()
            self.graph.stopped = "a property leaves 64-bit arithmetic in an initial configuration"
        self._set_up(roots if self.first_letters else [])

    # -------------------------------------------------- the beginning

    def _roots(self) -> list[bytes]:
        try:
            return list(dict.fromkeys(self._layout.initial(MAX_ROOTS)))
        except TooManyInitial as error:
            self.graph.stopped = str(error)
            return []

    def _first_letter(self, record: bytes) -> int:
        """Atoms over an initial configuration, with inputs at their `init`."""
        outputs = {v.name: v.init for v in self.program.vars if v.output}
        values = self._layout.decode(record) | outputs
        inputs = {f"input:{i.name}": i.init for i in self.program.inputs}
        return sum(1 << i for i, a in enumerate(self.program.atoms) if evaluate(a.expression, values, inputs))

    def free(self, root: int) -> tuple[tuple[str, int], ...]:
        """The values of the free variables in a root."""
        values = self._layout.decode(self.graph.key(root))
        free = [(v.name, values[v.name]) for v in self.program.vars if v.free]
        return tuple((name, value) for name, value in free if isinstance(value, int))

    def _set_up(self, roots: list[bytes]) -> None:
        """The memory of the exploration, with the roots in it."""
        self._kernels = kernels()
        graph, layout, outputs = self.graph, self._layout, self._record_words - self._layout.words
        self._nodes = VectorSet(self._kernels, graph.words, graph.keys)
        self._nodes.add_all(b"".join(r[: 8 * graph.words] for r in roots))
        self._letters = VectorSet(self._kernels, outputs, Region(1))
        graph.parents.grow(self._nodes.limit * NUMBER_BYTES)
        graph.parents.write(b"".join(i.to_bytes(NUMBER_BYTES, "little") for i in range(len(roots))))
        self._edge_limit, self._group_slots = FIRST_EDGES, FIRST_GROUP
        self._group = Region(FIRST_GROUP * GROUP_SLOT_BYTES)
        self._context = self._native.new_context()
        edge_bytes = self._native.edge_size
        capacity = max(1, BUFFER_BYTES // edge_bytes)
        self._scratch = [
            Region(size)
            for size in (
                BATCH * 8 * self._record_words,  # 0: the batch
                capacity * edge_bytes,  # 1: its edges
                capacity * 16,  # 2: their hash values and labels
                8 * outputs * 4 + 8,  # 3: fresh, mask, two keys of letters
                8 * b.SMALL_GROUP,  # 4: the small group
                8 * max(1, len(self.program.faults)),  # 5: faults
            )
        ]
        batch, edges, prepared, letters, small, faults = (r.address for r in self._scratch)
        self._scratch[3].write(self._fresh + self._letter_mask())
        self._scratch[5].write(b"\xff" * (8 * len(self.program.faults)))
        field = layout.fields[self.program.cycle]
        block = self._block = (ctypes.c_int64 * b.EXPLORATION_WORDS)()
        settings = {
            b.NODES: self._nodes.address, b.LETTERS: self._letters.address,
            b.WORDS: graph.words, b.CONFIGURATION: layout.words, b.RECORD: self._record_words,
            b.CYCLE_WORD: field.place(0)[0], b.CYCLE_BIT: field.place(0)[1], b.WITH_EDGES: int(graph.with_edges),
            b.FRESH: letters, b.LETTER_MASK: letters + 8 * outputs,
            b.LETTER_KEY: letters + 16 * outputs, b.LAST_KEY: letters + 24 * outputs, b.LAST_LABEL: -1,
            b.CONTEXT: ctypes.addressof(self._context), b.CONTEXT_SOURCE: SOURCE,
            b.EDGE_BYTES: edge_bytes, b.EDGE_BODY: self._native.record_offset,
            b.BROKEN_STATUS: BROKEN & 0xFFFFFFFF, b.OVERFLOW_STATUS: OVERFLOW & 0xFFFFFFFF,
            b.BATCH: batch, b.BATCH_CAPACITY: BATCH, b.EDGES: edges, b.EDGES_CAPACITY: capacity,
            b.EDGE_HASHES: prepared, b.EDGE_LABELS: prepared + 8 * capacity,
            b.SOURCE: -1, b.LEVEL_END: len(roots), b.CONFIGURATIONS: len(roots),
            b.FAULTS: faults, b.OVERFLOW: -1, b.GROUP_FIRST: small,
        }  # fmt: skip
        for word, value in settings.items():
            block[word] = value
        if self._with_chains:
            self._chains = Chains(self._kernels, self._native, graph, self._fresh, capacity)
            block[b.CHAINS] = self._chains.address
        graph.roots = len(roots)
        self._place()
        self._read_back()

    def _letter_mask(self) -> bytes:
        """Output words in which the bits of the observed outputs are set."""
        mask = 0
        for _, output in observed_outputs(self.program):
            field = self._layout.fields[output]
            word, shift = field.place(0)
            mask |= (1 << field.bits) - 1 << 64 * (word - self._layout.words) + shift
        return mask.to_bytes(len(self._fresh), "little")

    # -------------------------------------------------- exploration

    def explore(self, target: int | None) -> None:
        """Expand nodes in order until there are `target` of them, none is left, or a limit is reached.

        The graph says which: `complete`, or `stopped` with the reason. Raises KeyboardInterrupt between portions.
        """
        graph, most = self.graph, self._allowance.max_states
        while graph.stopped is None and not graph.exhausted:
            if target is not None and graph.count >= target:
                return
            goal = MAX_NODES if target is None else target
            try:
                self._allowance.check()
                if most is not None and graph.configurations > most:
                    raise LimitReached(f"the limit of {most} configurations was reached")
                self._goal = goal if most is None else min(goal, most + 1)
                self._run(self._goal)
            except LimitReached as error:
                graph.stopped = str(error)
                return
            if self._report is not None:
                self._report(graph)
        graph.complete = graph.stopped is None and graph.overflow is None
        if self._cycles and graph.exhausted:
            self._count_cycles()

    @property
    def counted(self) -> bool:
        """The graph's numbers of configurations and transitions are those of the whole graph as far as it was explored:
        always, but for chains before `count`."""
        return self._chains is None or self._counted

    def is_worth_chains(self) -> bool:
        """At least half of the nodes expanded, as far as a sample tells, have one step only."""
        graph, single = self.graph, 0
        if self._cycles or not graph.expanded:
            return False
        sample = range(0, graph.expanded, -(-graph.expanded // SAMPLE))
        for node in sample:
            single += len(list(islice(self._native.edges(graph.record(node) + self._fresh, 1), 2))) == 1
        return 2 * single >= len(sample)

    def count(self) -> bool:
        """Count what lies on the chains of a complete graph; false when a limit ends that: the numbers are too small.

        Raises KeyboardInterrupt.
        """
        if self.counted or self._chains is None or not self.graph.complete:
            return self.counted
        try:
            self._block[b.EXPAND] = self._native.expand_address
            self._chains.count(self._block, self._allowance, self._serve_count)
        except LimitReached:
            return False
        self._counted = True
        return True

    def _serve_count(self, code: int) -> None:
        """What a kernel that counts needs before it goes on."""
        if code == b.BROKEN:
            raise BrokenProgramError(self.program.name)
        if code == b.ROOM_GROUP:
            self._more_group()
            self._place()
        self._block[b.PORTION_EDGES] = self._portion = min(2 * self._portion, LARGEST_PORTION)
        if self._report is not None:
            self._report(self.graph)

    def _count_cycles(self) -> None:
        """Distinct pairs of a configuration and the one that a whole cycle leads to."""
        assert self._kernels is not None
        graph, regions = self.graph, [Region(NUMBER_BYTES * self.graph.count) for _ in range(3)]
        block = (ctypes.c_int64 * b.PAIRS_WORDS)(
            graph.count, graph.roots, graph.first.address, graph.targets.address, graph.labels.address,
            *(r.address for r in regions), 0, 0,
        )  # fmt: skip
        try:
            while self._kernels.run("cycle_pairs", ctypes.addressof(block)) == b.PORTION:
                self._allowance.check()
        except LimitReached as error:
            graph.complete, graph.stopped = False, str(error)
        else:
            graph.transitions = block[b.PAIRS_FOUND]
        finally:
            for region in regions:
                region.close()

    def _run(self, found: int) -> None:
        """One call of the kernel, and what it asks for."""
        assert self._kernels is not None
        block, native = self._block, self._native
        self._sound = False
        block[b.EXPAND] = native.expand_address
        block[b.PORTION_EDGES], block[b.STOP], block[b.FOUND_STOP] = self._portion, MAX_NODES, found
        name = "cycles" if self._cycles else {1: "1", 2: "2"}.get(self.graph.words, "any")
        began, seen = perf_counter(), block[b.SEEN_EDGES]
        code = self._kernels.run(f"{'explore' if self._chains is None else 'chains'}_{name}", ctypes.addressof(block))
        native.spend(perf_counter() - began)
        if block[b.SEEN_EDGES] - seen >= self._portion:
            self._portion = min(2 * self._portion, LARGEST_PORTION)
        self._read_back()
        if code == b.BROKEN:
            raise BrokenProgramError(self.program.name)
        self._sound = True  # limits are looked at before anything is changed
        if block[b.SOURCE_EDGES] > MAX_STEPS:
            raise LimitReached(self._too_many_steps())
        self._make_room(code)

    def _make_room(self, code: int) -> None:
        if code == b.ROOM_NODES:
            self._more_nodes()
        elif code == b.ROOM_EDGES:
            self._edge_limit *= 2
        elif code == b.ROOM_LETTERS:
            self._more_letters()
        elif code == b.ROOM_GROUP:
            self._more_group()
        self._place()
        self._sound = True

    def _more_nodes(self) -> None:
        if self._nodes.limit >= MAX_NODES // 2:
            raise LimitReached(f"there are more than {self._nodes.limit} nodes, more than this engine numbers")
        self._allowance.check(self._nodes.table_bytes)
        self._sound = False
        self._nodes.grow()

    def _more_letters(self) -> None:
        chains = self._chains
        if chains is not None and chains.is_full:
            chains.check(self._allowance)
        self._sound = False
        if self._letters.count >= self._letters.limit:
            self._letters.grow()
        if chains is not None and chains.is_full:
            chains.grow()

    def _more_group(self) -> None:
        """A larger table of one configuration's successors."""
        assert self._kernels is not None
        most, block = self._allowance.max_states, self._block
        if most is not None and block[b.GROUP_COUNT] > max(most, 1) * LETTERS_EACH:
            raise LimitReached(f"the limit of {most} configurations was reached")
        self._allowance.check(4 * self._group_slots * GROUP_SLOT_BYTES)
        self._sound = False
        old, slots = self._group, 4 * self._group_slots
        self._group = Region(slots * GROUP_SLOT_BYTES)
        request = (ctypes.c_int64 * 5)(
            self._group.address, slots - 1, block[b.GENERATION], old.address, self._group_slots
        )  # fmt: skip
        self._kernels.run("regroup", ctypes.addressof(request))
        self._group_slots = slots
        old.close()

    def _place(self) -> None:
        """Make room as far as the limits say, and tell the kernel where things are: growing memory moves."""
        graph, block = self.graph, self._block
        limit = self._nodes.limit
        graph.parents.grow(limit * NUMBER_BYTES)
        if graph.with_edges:
            graph.first.grow((limit + 1) * FIRST_BYTES)
            graph.targets.grow(self._edge_limit * NUMBER_BYTES)
            graph.labels.grow(self._edge_limit * NUMBER_BYTES)
        block[b.PARENTS], block[b.FIRST] = graph.parents.address, graph.first.address
        block[b.TARGETS], block[b.LABELS] = graph.targets.address, graph.labels.address
        block[b.EDGE_LIMIT] = self._edge_limit
        block[b.GROUP_TABLE], block[b.GROUP_MASK] = self._group.address, self._group_slots - 1
        block[b.GROUP_LIMIT] = self._group_slots // 4  # a pair takes up to two slots, and half of them stay free

    def _read_back(self) -> None:
        """What the kernel has found out, in the graph."""
        graph, block = self.graph, self._block
        graph.count, graph.expanded = self._nodes.count, block[b.EXPANDED]
        graph.configurations, graph.edge_count = block[b.CONFIGURATIONS], block[b.EDGE_COUNT]
        graph.transitions, graph.depth = block[b.TRANSITIONS], block[b.DEPTH]
        graph.overflow = None if block[b.OVERFLOW] < 0 else block[b.OVERFLOW]
        first = array("q", self._scratch[5].read(0, 8 * len(self.program.faults)))
        graph.faults = {fault: node for fault, node in enumerate(first) if node >= 0}
        width = 8 * self._letters.words
        for label in range(len(graph.alphabet), self._letters.count):
            record = bytes(self._width) + self._letters.keys.read(label * width, width)
            graph.alphabet.append(sum(1 << i for i, read in enumerate(self._readers) if read(record)))
        if self._chains is not None:
            self._chains.read_back()

    def _too_many_steps(self) -> str:
        widest = max(self.program.choices, key=lambda c: c.type.high - c.type.low)
        size = widest.type.high - widest.type.low + 1
        return (
            f"one configuration has more than {MAX_STEPS} steps, more than this engine enumerates: "
            f"`{widest.input or widest.name}` alone has {size} values; declare a smaller range"
        )

    def close(self) -> None:
        """Give the memory back: the graph's too."""
        for region in (self._group, self._letters.keys, *self._scratch):
            region.close()
        if self._chains is not None:
            self._chains.close()
        self._nodes.close()
        self._letters.close()
        self.graph.close()

    # -------------------------------------------------- checkpoints

    @property
    def text(self) -> str:
        """What the program is compiled from: it decides what the words of a node mean."""
        return self._native.text

    def settle(self, seconds: float) -> bool:
        """Go on to the end of a batch of nodes, where the exploration can be saved; false when that takes longer.

        Raises LimitReached.
        """
        end, block = perf_counter() + seconds, self._block
        if not self._sound:
            return False
        block[b.SETTLE], runs = 1, 0
        self._nodes.stretch()
        self._place()
        try:
            while block[b.BATCH_COUNT] and self.graph.count < self._goal and (runs < 4 or perf_counter() < end):
                self._run(self._goal)
                runs += 1  # the first may compile
        finally:
            block[b.SETTLE] = 0
        return not block[b.BATCH_COUNT]

    def saved(self) -> tuple[list[int], list[tuple[Region, int]]]:
        """What `restore` needs, after `settle`: numbers, and regions with the bytes used of each."""
        graph, first = self.graph, array("q", self._scratch[5].read(0, 8 * len(self.program.faults)))
        words = 0 if self._chains is None else self._chains.words.count
        numbers = [graph.count, self._letters.count, words, *(self._block[word] for word in _SAVED), *first]
        sizes = [
            graph.count * graph.words * 8,
            graph.count * NUMBER_BYTES,
            (graph.expanded + 1) * FIRST_BYTES if graph.with_edges else 0,
            graph.edge_count * NUMBER_BYTES,
            graph.edge_count * NUMBER_BYTES,
            self._letters.count * self._letters.words * 8,
            *(() if self._chains is None else (words * 8,)),
        ]
        return numbers, list(zip(self._regions, sizes, strict=True))

    @property
    def _regions(self) -> list[Region]:
        graph = self.graph
        words = [] if self._chains is None else [self._chains.words.keys]
        return [graph.keys, graph.parents, graph.first, graph.targets, graph.labels, self._letters.keys, *words]

    def restore(self, numbers: Sequence[int], read: Callable[[Sequence[Region]], None]) -> None:
        """Go back to what `saved` gave; `read` puts the bytes into the regions."""
        nodes, letters, words, *rest = numbers
        block = self._block
        self._sound = False
        read(self._regions)
        self._nodes.restore(nodes)
        self._letters.restore(letters)
        if self._chains is not None:
            self._chains.words.restore(words)
        for word, value in zip(_SAVED, rest, strict=False):
            block[word] = value
        self._scratch[5].write(array("q", rest[len(_SAVED) :]).tobytes())
        while self._edge_limit < 2 * block[b.EDGE_COUNT]:
            self._edge_limit *= 2
        block[b.BATCH_COUNT] = block[b.EDGES_COUNT] = block[b.EDGES_DONE] = block[b.GROUP_COUNT] = 0
        self._place()
        self._read_back()
        self._sound = True

    # -------------------------------------------------- witnesses

    def _moves(self, node: int) -> Iterator[tuple[Move, int, bytes, bool]]:
        """The steps from a node: the move, its status, the node it leads to, and whether a letter is shown."""
        record = self.graph.record(node)
        if not self._cycles:
            record += self._fresh
        for edge in self._native.edges(record, 1):
            move = self._move(edge)
            yield (
                move,
                edge.status,
                edge.record,
                not self._cycles or move.process is None or self._ends(edge.record),
            )

    def _move(self, edge: Edge) -> Move:
        choices = self.program.choices
        return Move(None if edge.process < 0 else edge.process, {choices[c].name: v for c, v in edge.samples})

    def _ends(self, record: bytes) -> bool:
        return bool(self._cycle(record))

    def _letter(self, record: bytes) -> int:
        return sum(1 << i for i, read in enumerate(self._readers) if read(record))

    def witness(self, source: int, target: int, letter: Letters) -> list[Move]:
        """The move of an edge of the graph, in a list; `letter` None: in the middle of a cycle, or any.

        Of a chain, all moves, or as many as `letter` has letters. Raises KeyError when there is none.
        """
        node = self.graph.record(target)
        if self._chains is not None:
            return self._chain_witness(source, node, letter)
        for move, status, record, shown in self._moves(source):
            if status == 0 and (letter is None or (shown and self._letter(record) == letter)):
                key = record[: self._width] + self._fresh if self._cycles and shown else record
                if key[: len(node)] == node:
                    return [move]
        raise KeyError(f"no step from node {source} to {target}")

    def _chain_witness(self, source: int, target: bytes, letters: Letters) -> list[Move]:
        assert self._chains is not None
        assert not isinstance(letters, int)
        for first in self._native.edges(self.graph.record(source) + self._fresh, 1):
            moves: list[Move] = []
            for edge in self._chains.from_edge(first):
                place = len(moves)
                if letters is not None and place < len(letters) and self._letter(edge.record) != letters[place]:
                    break
                moves.append(self._move(edge))
                if edge.record[: len(target)] == target and (letters is None or len(moves) >= len(letters)):
                    return moves if letters is None else moves[: len(letters)]
        raise KeyError(f"no chain of steps from node {source} to that node")

    def fault_witness(self, source: int, fault: int) -> list[Move]:
        """The move that leads from a node into a fault, in a list. Raises KeyError when there is none."""
        for move, status, _, _ in self._moves(source):
            if status == fault + 1:
                return [move]
        raise KeyError(f"fault {fault} does not happen from node {source}")
