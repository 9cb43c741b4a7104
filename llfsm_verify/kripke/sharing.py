"""Threads that explore together: chunks of nodes for the kernels `work_…` (`kernels.shared`), and their memory."""

from __future__ import annotations

import ctypes
import weakref
from array import array
from collections.abc import Callable
from math import gcd
from threading import Lock, Thread
from time import perf_counter

from llfsm_verify.backends.native.context import PREFIX, PROCESS, STEPPED
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.interrupts import whole
from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels import shared_blocks as s
from llfsm_verify.kripke.memory import Region, VectorSet

SMALLEST = 1 << 15
"""Nodes that are known before threads are worth while."""
FEWEST = 1 << 10
"""Nodes of the smallest chunk."""
CHUNK_ENTRIES = 1 << 17
"""Successors of a chunk, about: tables of them stay in the cache."""
ARENA_ENTRIES = 1 << 20
"""Successors of a chunk for which each thread has room."""
MARGIN = 1.25
"""So many times as many new nodes as the last chunk had, for each node, should have room."""
MOST_TASKS = 1 << 12
MOST_NUMBERS = (1 << 32) - (MOST_TASKS << s.POSITION_BITS) - 2
"""Nodes up to which there are temporary numbers behind them."""
SPREAD_ALONE = 1 << 17
"""Slots of a table that one thread moves."""
SECONDS = 0.03
"""About how long signals and limits wait."""
STRIDE, DELAY = 1, 0
"""Tests set them: see `kernels.shared_blocks`."""


class Sharing:
    """`jobs` threads, the caller's included, that expand chunks of nodes with the results of one thread."""

    def __init__(self, kernels: Kernels, native: NativeProgram, block: ctypes.Array[ctypes.c_int64], jobs: int) -> None:
        """`block`: the control block of the exploration."""
        self._kernels = kernels
        self._block = block
        words, record = block[b.WORDS], block[b.RECORD]
        self._kernel = f"work_{words if words <= 2 else 'any'}"
        kernels.load(self._kernel)
        self._entry_bytes = 8 * (words + s.ENTRY_WORDS)
        self._task_table = Region(MOST_TASKS * s.TASK_WORDS * 8)
        self._shared = (ctypes.c_int64 * s.SHARED_WORDS)()
        settings = {
            s.BLOCK: ctypes.addressof(block), s.TASK_TABLE: self._task_table.address, s.DELAY: DELAY,
            s.STRIDE_BYTES: self._entry_bytes, s.ENTRY_LIMIT: ARENA_ENTRIES,
        }  # fmt: skip
        for word, value in settings.items():
            self._shared[word] = value
        outputs = record - block[b.CONFIGURATION]
        self._faults = 1 + len(native.program.faults)
        sizes = (
            8 * s.NODES_EACH * record, block[b.EDGES_CAPACITY] * block[b.EDGE_BYTES],
            ARENA_ENTRIES * self._entry_bytes, 8 * s.GROUP_SLOTS, 16 * outputs, 8 * self._faults,
        )  # fmt: skip
        self._threads = [_Member(kernels, self._kernel, native, self._shared, sizes, outputs, i) for i in range(jobs)]
        for member in self._threads[1:]:
            member.start()
            weakref.finalize(self, member.close).atexit = False  # daemons end with the process, even amid a phase
        self._size = 4 * FEWEST
        self._alone_until = 0
        self._each, self._new = 4.0, 4.0
        """Steps of a node, and new nodes that it leads to, as the last chunk had them."""

    def chunk(self, nodes: VectorSet, found: int, steps: int) -> int:
        """How many nodes to expand next; 0: that is for one thread. At `found` nodes or after `steps` steps the
        exploration stops."""
        block = self._block
        count, expanded = nodes.count, block[b.EXPANDED]
        if not SMALLEST <= count <= MOST_NUMBERS or expanded < self._alone_until:
            return 0
        room = (
            min(nodes.limit - count, found - count) / (MARGIN * self._new),
            (steps - block[b.SEEN_EDGES]) / self._each,
        )
        few = max(FEWEST, CHUNK_ENTRIES / self._each)
        size = int(min(count - expanded, self._size, few, *room, MOST_TASKS * s.NODES_EACH))
        return size // s.NODES_EACH * s.NODES_EACH if size >= FEWEST else 0

    @whole
    def explore(self, nodes: VectorSet, found: int, steps: int) -> int:
        """Expand chunk after chunk for a while, beginning where a batch would begin.

        b.DONE when all is well; b.ROOM_EDGES when edges need more room; b.PORTION when one thread has to go on.
        """
        end, block = perf_counter() + SECONDS, self._block
        while perf_counter() < end:
            size = self.chunk(nodes, found, steps)
            if size == 0:
                return b.PORTION
            if block[b.WITH_EDGES] and block[b.EDGE_COUNT] + int(size * self._each) > block[b.EDGE_LIMIT]:
                return b.ROOM_EDGES
            code = self._expand(size, nodes, found, steps)
            if code != b.DONE:
                return code
        return b.DONE

    def _expand(self, size: int, nodes: VectorSet, found: int, steps: int) -> int:
        """Expand so many nodes; where the code is not b.DONE, nothing has changed."""
        block, shared = self._block, self._shared
        tasks, count = size // s.NODES_EACH, nodes.count
        ctypes.memset(self._task_table.address, 0, tasks * s.TASK_WORDS * 8)
        shared[s.START], shared[s.ROOM], shared[s.FAILED] = block[b.EXPANDED], count, 0
        for member in self._threads:
            member.begin(self._faults)
        self._all(s.EXPAND, tasks)
        if shared[s.FAILED] == 0:
            self._all(s.JUDGE, tasks)
            self._alone(s.SUM)
        total, taken = count + shared[s.FOUND], sum(m.block[s.STEPS] for m in self._threads)
        stops = total >= found or block[b.SEEN_EDGES] + taken >= steps
        full = block[b.WITH_EDGES] != 0 and block[b.EDGE_COUNT] + shared[s.STORED] > block[b.EDGE_LIMIT]
        if shared[s.FAILED] != 0 or stops or full:
            self._alone(s.UNDO)
            if full and shared[s.FAILED] == 0:
                return b.ROOM_EDGES
            lacked = bool(shared[s.FAILED] == s.NO_ROOM)
            self._size = max(FEWEST, size // (2 if lacked else 4))
            self._alone_until = block[b.EXPANDED] + (size if stops else FEWEST if lacked else self._size)
            return b.PORTION
        self._all(s.NUMBER, tasks)
        if block[b.WITH_EDGES]:
            self._all(s.EDGES, tasks)
        self._keep(size, nodes, taken)
        return b.DONE

    def _keep(self, size: int, nodes: VectorSet, steps: int) -> None:
        """Tell the exploration what was found."""
        block, shared, members = self._block, self._shared, self._threads
        nodes.add(shared[s.FOUND])
        block[b.EXPANDED] += size
        block[b.SOURCE], block[b.SOURCE_EDGES], block[b.GROUP_COUNT] = block[b.EXPANDED] - 1, 0, 0
        block[b.SEEN_EDGES] += steps
        block[b.TRANSITIONS] += sum(m.block[s.TRANSITIONS] for m in members)
        block[b.CONFIGURATIONS] += sum(m.block[s.CONFIGURATIONS] for m in members)
        if block[b.WITH_EDGES]:
            block[b.EDGE_COUNT] += shared[s.STORED]
        if shared[s.CROSSED] >= 0:
            block[b.LEVEL_END] = shared[s.CROSSED]
            block[b.DEPTH] += 1
        met = [m.faults(self._faults) for m in members if m.block[s.FAULTED]]
        if met:
            first = [min((node for node in column if node >= 0), default=-1) for column in zip(*met, strict=True)]
            if block[b.OVERFLOW] < 0:
                block[b.OVERFLOW] = first[0]
            known = (ctypes.c_int64 * (self._faults - 1)).from_address(block[b.FAULTS])
            for fault, node in enumerate(first[1:]):
                if known[fault] < 0:
                    known[fault] = node
        self._each, self._new = max(1.0, steps / size), max(1.0, shared[s.FOUND] / size)
        self._size = min(2 * self._size, MOST_TASKS * s.NODES_EACH)

    def spread(self, nodes: VectorSet, end: int) -> int:
        """Move the slots of a table that has become twice as large, the last ones first; the slot before which those
        end that are left: all from `end` on have been moved.

        Each round moves the last half of what is left to behind all of it. It begins behind a line of eight slots that
        is not full: then no search that ends there has begun before.
        """
        table = (ctypes.c_int64 * (nodes.slots // 2)).from_address(nodes.table)
        while end > SPREAD_ALONE:
            begin = -(-end // 16) * 8
            while begin < end and all(table[begin - 8 : begin]):
                begin += 8
            if begin >= end:
                break
            self._shared[s.START], self._shared[s.MOVED_TO], self._shared[s.FAILED] = begin, end, 0
            self._all(s.SPREAD, -(-(end - begin) // s.SLOTS_EACH))
            end = begin
        return end

    def _all(self, phase: int, tasks: int) -> None:
        """All threads do the tasks of a phase."""
        shared = self._shared
        shared[s.PHASE], shared[s.TASKS], shared[s.NEXT] = phase, tasks, 0
        shared[s.STRIDE] = next(n for n in range(STRIDE, STRIDE + tasks + 1) if gcd(n, tasks) == 1)
        for member in self._threads[1:]:
            member.go()
        try:
            self._alone(phase)
        finally:
            failures = [member.wait() for member in self._threads[1:]]
        for failure in failures:
            if failure is not None:
                raise failure

    def _alone(self, phase: int) -> None:
        self._shared[s.PHASE] = phase
        self._kernels.run(self._kernel, self._threads[0].address)

    def close(self) -> None:
        """End the threads, and give the memory back."""
        for member in self._threads:
            member.close()
        self._task_table.close()


class _Member:
    """One of the threads, and its memory; the first is the caller's."""

    def __init__(
        self, kernels: Kernels, kernel: str, native: NativeProgram, shared: ctypes.Array[ctypes.c_int64],
        sizes: tuple[int, ...], outputs: int, number: int,
    ) -> None:  # fmt: skip
        self._run: Callable[[], int] = lambda: kernels.run(kernel, self.address)
        self._context = native.new_context()
        self._regions = [Region(size) for size in sizes]
        batch, buffer, arena, group, key, faults = (r.address for r in self._regions)
        self.block = (ctypes.c_int64 * s.THREAD_WORDS)()
        settings = {
            s.SHARED: ctypes.addressof(shared), s.CONTEXT: ctypes.addressof(self._context), s.BATCH: batch,
            s.BUFFER: buffer, s.ARENA: arena, s.GROUP: group, s.KEY: key, s.LAST_KEY: key + 8 * outputs,
            s.LAST_LABEL: -1, s.FAULTS: faults, s.FAULTED: 1, s.RANDOM: DELAY + number,
        }  # fmt: skip
        for word, value in settings.items():
            self.block[word] = value
        self._begin, self._end, self._closed = Lock(), Lock(), False
        self._thread: Thread | None = None
        self._failure: BaseException | None = None

    @property
    def address(self) -> int:
        """Of the control block."""
        return ctypes.addressof(self.block)

    def start(self) -> None:
        """Begin to wait for `go`."""
        self._begin.acquire()
        self._end.acquire()
        self._thread = Thread(target=self._serve, name="llfsm-explore", daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            self._begin.acquire()
            if self._closed:
                return
            try:
                self._run()
            except BaseException as error:  # noqa: BLE001 - the caller raises it
                self._failure = error
            self._end.release()

    def go(self) -> None:
        """Begin with the tasks of a phase."""
        self._begin.release()

    def wait(self) -> BaseException | None:
        """Wait until no task is left for this thread; what it raised."""
        self._end.acquire()
        failure, self._failure = self._failure, None
        return failure

    def begin(self, faults: int) -> None:
        """Forget the last chunk, and where its last steps were enumerated, if it was not expanded to the end."""
        for word in (PREFIX, PROCESS, STEPPED):
            self._context[word] = 0
        for word in (s.ENTRIES, s.STEPS, s.TRANSITIONS, s.CONFIGURATIONS):
            self.block[word] = 0
        if self.block[s.FAULTED]:
            ctypes.memset(self.block[s.FAULTS], 0xFF, 8 * faults)
            self.block[s.FAULTED] = 0

    def faults(self, faults: int) -> array[int]:
        """For overflow and for each fault the first node that it happens from, or -1."""
        return array("q", self._regions[5].read(0, 8 * faults))

    def close(self) -> None:
        """End the thread, and give the memory back."""
        if self._thread is not None and not self._closed:
            self._closed = True
            self._begin.release()
            self._thread.join()
        for region in self._regions:
            region.close()
