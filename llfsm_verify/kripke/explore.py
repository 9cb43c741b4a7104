"""Breadth-first exploration of a step program by the kernels."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from time import perf_counter, thread_time
from typing import TYPE_CHECKING

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.native.layout import Layout, TooManyInitial
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.checkpoint import Numbers, Section, Unusable
from llfsm_verify.kripke.compiled import Kernels, kernels
from llfsm_verify.kripke.graph import MAX_NODES, NUMBER_BYTES, Graph
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.kripke.tables import Tables
from llfsm_verify.kripke.witnesses import GraphWitnesses
from llfsm_verify.limits import Budget, LimitReached, reached
from llfsm_verify.program.program import Program
from llfsm_verify.stages import stage

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.labels import Labels
    from llfsm_verify.kripke.sharing import Sharing

FIRST_PORTION, LARGEST_PORTION = 1 << 12, 1 << 19
"""Steps in the first and in later calls of the kernel; the largest takes some hundredths of a second."""
SHARE = 0.25
"""About what the steps themselves take of the time of a kernel."""
MOST = 1 << 62
"""Steps without a limit."""
MAX_ROOTS = 1 << 20
SAMPLE = 500
"""Nodes that are looked at to tell whether chains are worth while."""


class Explorer:
    """Explores one program into a `Graph`, in portions; witnesses of its edges are found again when asked for.

    With ``observe: cycle`` the graph's nodes are also the records in the middle of cycles (see `Graph`).
    `with_edges` False: only configurations are stored, as much as faults and counts need. `chains`: configurations with
    one step only are passed over, and an edge shows a word of letters; not with ``observe: cycle``.
    """

    def __init__(
        self,
        program: Program,
        budget: Budget,
        report: Callable[[Graph], None] | None = None,
        *,
        with_edges: bool = True,
        chains: bool = False,
        labels: Labels | None = None,
        roots: Callable[[Layout], Iterable[bytes]] | None = None,
        jobs: int = 1,
    ) -> None:
        """`labels`: those of the program, which is then explored by classes of inputs. `roots`: records to begin with
        in place of the initial ones. `jobs`: threads that explore large graphs, but for chains; nothing that is found
        depends on their number.

        Raises ValueError for chains where whole cycles are observed.
        """
        if chains and program.observe == "cycle":
            raise ValueError("there are no chains of whole cycles")
        self.program = program
        self.budget = budget
        self._report = report
        self.labels = labels
        explored = program if labels is None else labels.program
        self._native = NativeProgram(explored)
        layout = self.layout = self._native.layout
        self._cycles = program.observe == "cycle"
        fresh = self._fresh = layout.encode_outputs(layout.initial_outputs())
        words = layout.words + (layout.output_words if self._cycles else 0)
        self.graph = Graph(
            words, layout.configuration_bytes, with_edges or self._cycles, fresh if self._cycles else b""
        )  # fmt: skip
        self.graph.has_silent_edges = self._cycles
        observer = Observer(explored, layout)
        self.observed = observer.names
        self._portion = FIRST_PORTION
        self._goal = 0
        self._counted = False
        first = self._roots() if roots is None else list(dict.fromkeys(roots(layout)))
        try:
            self.first_letters = tuple(observer.first_letter(root) for root in first)
            """The letter c0 of each root."""
        except OverflowError:
            self.first_letters = ()
            self.graph.stopped = "a property leaves 64-bit arithmetic in an initial configuration"
        self._kernels: Kernels = kernels()
        kept = first if self.first_letters else []
        self._tables = Tables(self._native, self.graph, observer, self._kernels, kept, with_chains=chains, jobs=jobs)
        self._chains = self._tables.chains
        self.witnesses = GraphWitnesses(self._native, observer, self.graph, self._chains, labels)

    # -------------------------------------------------- the beginning

    def _roots(self) -> list[bytes]:
        try:
            return list(dict.fromkeys(self.layout.initial(MAX_ROOTS)))
        except TooManyInitial as error:
            self.graph.stopped = str(error)
            return []

    def free(self, root: int) -> tuple[tuple[str, int], ...]:
        """The values of the free variables in a root."""
        values = self.layout.decode(self.graph.key(root))
        free = [(v.name, values[v.name]) for v in self.program.vars if v.free]
        return tuple((name, value) for name, value in free if isinstance(value, int))

    # -------------------------------------------------- exploration

    @stage("exploring")
    def explore(self, target: int | None, most_steps: int | None = None) -> None:
        """Expand nodes in order until there are `target` of them, none is left, or a limit is reached: one of the
        budget, or about `most_steps` steps.

        The graph says which: `complete`, or `stopped` with the reason. Raises KeyboardInterrupt between portions.
        """
        graph, most = self.graph, self.budget.max_states
        limits = [n for n in (most_steps, self.budget.max_steps) if n is not None]
        while graph.stopped is None and not graph.exhausted:
            if target is not None and graph.count >= target:
                return
            goal = MAX_NODES if target is None else target
            try:
                self.budget.check()
                if most is not None and graph.configurations > most:
                    raise LimitReached(reached(most, "configurations"))
                # Of whole cycles, nodes are more than configurations.
                self._goal = goal if most is None else min(goal, graph.count + most + 1 - graph.configurations)
                if limits and self.steps > min(limits):
                    raise LimitReached(reached(min(limits), "steps"))
                self._advance(self._goal, min(limits, default=MOST) + 1)
            except LimitReached as error:
                graph.stopped = str(error)
                return
            if self._report is not None:
                self._report(graph)
        if graph.exhausted:
            self._tables.end_sharing()
        graph.complete = graph.stopped is None and graph.overflow is None
        if self._cycles and graph.exhausted:
            self._count_cycles()

    @property
    def steps(self) -> int:
        """Steps taken so far, those that fault and each choice of values included."""
        return self._tables.block[b.SEEN_EDGES]

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

    def varies(self, names: Sequence[str]) -> bool:
        """Some of these variables has different values in different nodes, as far as a sample tells."""
        graph = self.graph
        readers = [self.layout.reader(name) for name in names if self.layout.fields[name].length is None]
        if len(readers) < len(names) or self._cycles or not graph.expanded:
            return bool(names)
        first = graph.record(0)
        sample = range(0, graph.expanded, -(-graph.expanded // SAMPLE))
        return any(read(graph.record(node)) != read(first) for node in sample for read in readers)

    def count(self) -> bool:
        """Count what lies on the chains of a complete graph; false when a limit ends that: the numbers are too small.

        Raises KeyboardInterrupt.
        """
        if self.counted or self._chains is None or not self.graph.complete:
            return self.counted
        try:
            self._tables.block[b.EXPAND] = self._native.expand_address
            self._chains.count(self._tables.block, self.budget, self._serve_count)
        except LimitReached:
            return False
        self._counted = True
        return True

    def _serve_count(self, code: int) -> None:
        """What a kernel that counts needs before it goes on."""
        if code == b.BROKEN:
            raise BrokenProgramError(self.program.name)
        if code == b.ROOM_GROUP:
            self._tables.make_room(code, self.budget)
        self._tables.block[b.PORTION_EDGES] = self._portion = min(2 * self._portion, LARGEST_PORTION)
        if self._report is not None:
            self._report(self.graph)

    def _count_cycles(self) -> None:
        """Distinct pairs of a configuration and the one that a whole cycle leads to."""
        graph, regions = self.graph, [Region(NUMBER_BYTES * self.graph.count) for _ in range(3)]
        block = (ctypes.c_int64 * b.PAIRS_WORDS)(
            graph.count, graph.roots, graph.first.address, graph.targets.address, graph.labels.address,
            *(r.address for r in regions), 0, 0,
        )  # fmt: skip
        try:
            while self._kernels.run("cycle_pairs", ctypes.addressof(block)) == b.PORTION:
                self.budget.check()
        except LimitReached as error:
            graph.complete, graph.stopped = False, str(error)
        else:
            graph.transitions = block[b.PAIRS_FOUND]
        finally:
            for region in regions:
                region.close()

    def _advance(self, found: int, steps: int) -> None:
        """Go on by a portion, which ends at `found` nodes, or after `steps` steps in all."""
        tables, block = self._tables, self._tables.block
        sharing, portion = tables.sharing(), min(self._portion, steps - block[b.SEEN_EDGES])
        if sharing is None or not sharing.chunk(tables.nodes, found, steps):
            self._run(found, portion)
        elif block[b.BATCH_COUNT]:  # a chunk begins where a batch does
            block[b.SETTLE] = 1
            try:
                self._run(found, portion)
            finally:
                block[b.SETTLE] = 0
        else:
            self._share(sharing, found, steps)

    def _share(self, sharing: Sharing, found: int, steps: int) -> None:
        """All threads expand chunks of nodes, or one thread those at which they fail."""
        tables = self._tables
        code = self._call(lambda: sharing.explore(tables.nodes, found, steps))
        if code == b.PORTION:
            self._run(found, min(FIRST_PORTION, steps - tables.block[b.SEEN_EDGES]))
        else:
            tables.make_room(code, self.budget)

    def _run(self, found: int, portion: int | None = None) -> None:
        """One call of the kernel, and what it asks for."""
        block, tables = self._tables.block, self._tables
        portion = self._portion if portion is None else portion
        block[b.PORTION_EDGES], block[b.STOP], block[b.FOUND_STOP] = portion, MAX_NODES, found
        words = "cycles" if self._cycles else {1: "1", 2: "2"}.get(self.graph.words, "any")
        name, seen = f"{'explore' if self._chains is None else 'chains'}_{words}", block[b.SEEN_EDGES]
        code = self._call(lambda: self._kernels.run(name, ctypes.addressof(block)))
        if block[b.SEEN_EDGES] - seen >= self._portion:
            self._portion = min(2 * self._portion, LARGEST_PORTION)
        if block[b.SOURCE_EDGES] > b.MAX_STEPS:
            raise LimitReached(self._too_many_steps())
        tables.make_room(code, self.budget)

    def _call(self, run: Callable[[], int]) -> int:
        """Let kernels run, and read back what they have found. Limits are looked at before anything is changed."""
        tables, began = self._tables, thread_time()
        tables.block[b.EXPAND] = self._native.expand_address
        tables.sound = False
        try:
            code = run()
        except KeyboardInterrupt:  # raised when the kernel has returned, or before
            tables.read_back()
            tables.sound = True
            raise
        tables.sound = code != b.BROKEN
        self._native.spend(SHARE * (thread_time() - began))
        tables.read_back()
        if code == b.BROKEN or (self.labels is not None and self.labels.unknown in self.graph.faults):
            tables.sound = False
            raise BrokenProgramError(self.program.name)
        return code

    def drop_edges(self) -> None:
        """Store no edges from now on, and give the memory of those stored back; letters are numbered as before.

        Not with ``observe: cycle``, where cycles are counted by their edges.
        """
        assert not self._cycles
        self.graph.drop_edges()
        self._tables.place()

    def narrow(self, keeps: Callable[[int], bool]) -> bool:
        """Store only the edges with letters that `keeps` tells from now on, and give the memory of the others back;
        false, and nothing has changed, when most edges so far show such letters.

        Not with ``observe: cycle``, nor with chains.
        """
        assert not self._cycles
        assert self._chains is None
        return self._tables.narrow(keeps)

    def _too_many_steps(self) -> str:
        widest = max(self._native.program.choices, key=lambda c: c.type.high - c.type.low)
        size = widest.type.high - widest.type.low + 1
        return (
            f"one configuration has more than {b.MAX_STEPS:,} steps, more than this engine enumerates: "
            f"`{widest.source}` alone has {size} values; declare a smaller range"
        )

    def close(self) -> None:
        """Give the memory back: the graph's too."""
        self._tables.close()

    # -------------------------------------------------- checkpoints

    @property
    def text(self) -> str:
        """What the program is compiled from: it decides what the words of a node mean."""
        return self._native.text

    def finish_batch(self, seconds: float) -> bool:
        """Go on to the end of a batch of nodes, where the exploration can be saved; false when that takes longer.

        Raises LimitReached.
        """
        end, tables, block = perf_counter() + seconds, self._tables, self._tables.block
        if not tables.sound:
            return False
        block[b.SETTLE], runs = 1, 0
        tables.nodes.stretch()
        tables.place()
        try:
            while block[b.BATCH_COUNT] and self.graph.count < self._goal and (runs < 4 or perf_counter() < end):
                self._run(self._goal)
                runs += 1  # the first may compile
        finally:
            block[b.SETTLE] = 0
        return not block[b.BATCH_COUNT]

    def saved(self) -> tuple[Numbers, list[Section]]:
        """What `restore` needs, after `finish_batch`: numbers, and regions with the bytes used of each."""
        return self._tables.saved()

    def restore(self, numbers: Json, read: Callable[[Sequence[Section], Budget], None]) -> None:
        """Go back to what `saved` gave; `numbers` as in a header, `read` puts the bytes into the regions.

        Raises Unusable for what `saved` cannot have given, LimitReached. This explorer must then not be used any more.
        """
        found = Numbers.of_header(numbers, len(self._native.program.faults))
        if self.labels is not None and found.faults[self.labels.unknown] >= 0:
            raise Unusable("it is damaged")
        self._tables.restore(found, read, self.budget)
