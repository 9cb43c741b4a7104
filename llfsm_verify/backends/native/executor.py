"""Step programs as machine code: the one executor with which users explore, simulate, replay and run."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from struct import Struct
from time import perf_counter
from types import MappingProxyType
from typing import Literal, NamedTuple

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.native.code import BROKEN, EVENT_KINDS, OVERFLOW
from llfsm_verify.backends.native.context import (
    DRAWN,
    EDGE_HEADER,
    ENDED,
    EVENTS,
    PROCESS,
    RANDOM,
    READ,
    SAMPLES,
    SOURCE,
    STATUS,
    ContextLayout,
)
from llfsm_verify.backends.native.kernel import ModuleText
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.native.machine_code import SECONDS_A_LINE, Effort, MachineCode
from llfsm_verify.collector import paused_collector
from llfsm_verify.program.program import INT64_MAX, EventKind, Program
from llfsm_verify.stages import stage

__all__ = ["ENDED", "OVERFLOW", "Edge", "Expansion", "NativeProgram", "RunResult", "StepResult"]

RUN_PORTION = 1 << 17
"""Steps of a run in one native call, so that Ctrl-C is served soon."""
FIRST_CHUNK, LARGEST_CHUNK = 1 << 12, 1 << 19
"""Bytes of the first and of later buffers of an expansion."""

FULL_EFFORT_LINES = 20_000
"""Longer modules are only compiled for a quick start, unless asked: compiling cannot be interrupted."""
PATIENCE = 0.2
"""Seconds of slow steps that are always accepted."""

Samples = tuple[tuple[int, int], ...]
"""Index and value of each choice that a step read, in the order of first reading."""
Event = tuple[EventKind, int, tuple[int, ...]]
"""Kind, index of the machine, arguments."""
Data = bytes | bytearray | memoryview

_HEADER = Struct("<IiiI")

COMPILING = "compiling to machine code"


class StepResult(NamedTuple):
    """One step. `status` 0: done; 1 + the number of a fault; OVERFLOW. Unless it is 0, `record` is the one before."""

    status: int
    record: bytes
    samples: Samples
    events: tuple[Event, ...]
    read: int
    """How many of the samples its ringlet took; its letter shows the others, which no machine has sampled."""


class RunResult(NamedTuple):
    """Many steps. `status` is as for a step, or ENDED after a stuttering step; a step that fails is not in `steps`.

    `process` is the process that failed to step, else the one whose turn is next when they go round."""

    record: bytes
    steps: int
    status: int
    process: int
    choices: tuple[int, ...]
    """The values that choices have by default after the run."""


class Edge(NamedTuple):
    """One step from record number `source`; `process` -1 is the stutter.

    `record` is a successor when `status` is 0, else it shows how far the step had come."""

    source: int
    process: int
    status: int
    record: bytes
    samples: Samples


class Expansion:
    """All steps from some records, in portions: iterating yields pairs of a buffer and the number of edges in it.

    An edge takes `edge_size` bytes: u32 source, i32 process (-1: stutter), i32 status, u32 number of samples, the
    record at `record_offset`, and at `samples_offset` pairs of 64-bit integers (index and value of a choice). A buffer
    is overwritten by the next portion. Raises BrokenProgramError.
    """

    def __init__(self, native: NativeProgram, records: Data, count: int, chunk_edges: int | None = None) -> None:
        if len(records) != count * native.layout.record_bytes:
            raise ValueError(f"{count} records take {count * native.layout.record_bytes} bytes, not {len(records)}")
        if not 0 <= count < 1 << 32:
            raise ValueError("too many records for one expansion")
        self._native = native
        self._records = bytes(records)
        self._count = count
        self._chunk_edges = chunk_edges
        self.edge_size = native.edge_size
        self.record_offset = native.record_offset
        self.samples_offset = native.samples_offset

    def __iter__(self) -> Iterator[tuple[memoryview, int]]:
        context = self._native.new_context()
        size = FIRST_CHUNK
        while context[SOURCE] < self._count:
            capacity = self._chunk_edges or max(1, size // self.edge_size)
            buffer = (ctypes.c_char * (capacity * self.edge_size))()
            view = memoryview(buffer).cast("B")
            while context[SOURCE] < self._count:
                edges = self._native._expand(self._records, self._count, buffer, capacity, context)
                if context[STATUS] == BROKEN:
                    raise BrokenProgramError(self._native.program.name)
                if edges:
                    yield view[: edges * self.edge_size], edges
                if size < LARGEST_CHUNK and self._chunk_edges is None:
                    size = min(8 * size, LARGEST_CHUNK)
                    break

    def edges(self) -> Iterator[Edge]:
        """The edges one by one."""
        size, start, end = self.edge_size, self.record_offset, self.samples_offset
        for view, count in self:
            for at in range(0, count * size, size):
                source, process, status, samples = _HEADER.unpack_from(view, at)
                record = bytes(view[at + start : at + end])
                told = self._native._told(view[at + end : at + end + 16 * samples].cast("q").tolist())
                yield Edge(source, process, status, record, told)


class StepCode(MachineCode):
    """The functions of a step program's module (`backends.native.loops`)."""

    def __init__(self, text: Callable[[], str], effort: Effort, name: str | None = None) -> None:
        super().__init__(text, effort, name)
        i32, i64, pointer = ctypes.c_int32, ctypes.c_int64, ctypes.c_void_p
        self.step: Callable[..., int] = ctypes.CFUNCTYPE(i32, pointer, pointer, i64)(self.address("step"))
        self.run: Callable[..., int] = ctypes.CFUNCTYPE(i64, pointer, i64, i64, pointer)(self.address("run"))
        self.expand_address = self.address("expand")
        expand = ctypes.CFUNCTYPE(i64, pointer, i64, pointer, i64, pointer)
        self.expand: Callable[..., int] = expand(self.expand_address)


class NativeProgram:
    """A step program compiled for this computer, when it is first used.

    `events`: steps report what `Emit` statements tell, of all kinds or of these (only they are compiled in). `effort`:
    compile for a quick start or for quick steps; None: for a quick start, and again for quick steps once that pays.
    """

    def __init__(
        self, program: Program, *, events: bool | Collection[EventKind] = False, effort: Effort | None = None
    ) -> None:
        self.program = program
        self.events: Collection[EventKind] = (EVENT_KINDS if events else ()) if isinstance(events, bool) else events
        self._effort = effort
        self._compiled: StepCode | None = None
        self._spent = 0.0
        self.layout = Layout.of(program)
        self._context = ContextLayout.of(program, self.layout, self.events)
        self.edge_size = self._context.edge_bytes(self.layout)
        self.record_offset = EDGE_HEADER
        self.samples_offset = EDGE_HEADER + self.layout.record_bytes
        self._choices = {c.name: i for i, c in enumerate(program.choices)}
        self._unsigned = frozenset(i for i, c in enumerate(program.choices) if c.type.high > INT64_MAX)
        self._ended = [None if p.ended is None else self.layout.reader(p.ended) for p in program.processes]
        template = [0] * self._context.words
        template[self._context.defaults : self._context.stamps] = [c.type.low for c in program.choices]
        self._context_type = ctypes.c_int64 * self._context.words
        self._template = bytes(self._context_type(*template))

    # ------------------------------------------------------------ compiling

    @cached_property
    def text(self) -> str:
        """The LLVM module before optimisation."""
        with paused_collector(lasting=True):
            return ModuleText(self.program, self.layout, self._context, self.events).text

    @property
    def _code(self) -> StepCode:
        if self._compiled is None:
            with stage(COMPILING):
                self._compiled = self._machine_code(self._effort or "quick")
        return self._compiled

    def _machine_code(self, effort: Effort) -> StepCode:
        kept_as = self.program.kept_as
        name = None if kept_as is None else f"{kept_as} {' '.join(sorted(self.events))}"
        return StepCode(lambda: self.text, effort, name)

    @property
    def effort(self) -> Effort:
        """What the machine code in use was compiled for."""
        return self._code.effort

    @property
    def lines(self) -> int:
        """How many lines the LLVM module has before optimisation."""
        return self._code.lines

    def compile(self) -> None:
        """Compile now; else the first use does."""
        _ = self._code

    def spend(self, seconds: float) -> None:
        """Count the seconds that steps took: compile for quick steps when slow ones have taken as long as that will."""
        self._spent += seconds
        code = self._code
        if self._effort is None and code.effort == "quick" and code.lines <= FULL_EFFORT_LINES:
            if self._spent > max(PATIENCE, code.lines * SECONDS_A_LINE["full"]):
                with stage(COMPILING):
                    self._compiled = self._machine_code("full")

    @property
    def expand_address(self) -> int:
        """Of the machine code's `expand` (`backends.native.loops`): valid until `spend` is called."""
        return self._code.expand_address

    # ------------------------------------------------------------ steps

    def enabled(self, record: Data) -> list[int]:
        """The processes that may step; none is left of an arrangement that has ended."""
        return [i for i, ended in enumerate(self._ended) if ended is None or not ended(record)]

    def step(self, record: Data, process: int | None, choices: Mapping[str, int]) -> StepResult:
        """One step of `process` (None: the stutter). A choice that is not given has its lowest value.

        Raises ValueError when that step is not enabled, for a value outside its choice's type, or a record of the
        wrong size; KeyError for an unknown choice; BrokenProgramError.
        """
        self._check(record)
        enabled = self.enabled(record)
        if (process not in enabled) if process is not None else enabled:
            raise ValueError(f"process {process} may not step: enabled are {enabled}")
        context, layout = self.new_context(choices), self._context
        buffer = self._record_type.from_buffer_copy(record)
        number = len(self.program.processes) if process is None else process
        code = self._code  # held here: another thread may replace it meanwhile
        status = code.step(buffer, context, number)
        if status == BROKEN:
            raise BrokenProgramError(self.program.name)
        flat = context[layout.samples : layout.samples + 2 * context[SAMPLES]]
        samples = self._told(flat)
        after = bytes(record) if status else buffer.raw
        stutters = process is None
        read = 0 if stutters else len(samples) if status else context[READ]
        return StepResult(status, after, samples, self._read_events(context), read)

    def run(
        self,
        record: Data,
        steps: int,
        *,
        mode: Literal["first", "random"] = "first",
        seed: int = 0,
        stop_on_cycle: bool = False,
        process: int = 0,
        choices: Mapping[str, int] = MappingProxyType({}),
        table: Sequence[int] = (),
    ) -> RunResult:
        """Up to `steps` steps in machine code, ended early by a failing step, by the end of the arrangement (after one
        stuttering step) and, with `stop_on_cycle`, by the end of a cycle.

        `first`: choices have the values of `choices`, else their lowest ones, and the processes go round, beginning
        with `process`. `random`: each choice read is drawn uniformly from its type, each process from those enabled,
        reproducibly from `seed`. Where a `table` (`loops`, draw) is given, choices are drawn by it before each step.
        """
        self._check(record)
        if steps < 0:
            raise ValueError("a negative number of steps")
        context = self.new_context(choices)
        context[PROCESS] = process
        if mode == "random":
            context[RANDOM] = _nonzero_seed(seed)
        rows = (ctypes.c_int64 * max(1, len(table)))(*table)
        context[DRAWN] = ctypes.addressof(rows) if table else 0
        buffer = self._record_type.from_buffer_copy(record)
        done = 0
        while done < steps:
            portion = min(RUN_PORTION, steps - done)
            code, begin = self._code, perf_counter()
            ran = code.run(buffer, portion, int(stop_on_cycle), context)
            self.spend(perf_counter() - begin)
            done += ran
            if context[STATUS] or ran < portion or (stop_on_cycle and self._cycle(buffer.raw)):
                break
        status = context[STATUS]
        if status == BROKEN:
            raise BrokenProgramError(self.program.name)
        told = context[self._context.defaults : self._context.stamps]
        return RunResult(buffer.raw, done, status, context[PROCESS] % max(1, len(self.program.processes)), tuple(told))

    def _check(self, record: Data) -> None:
        if len(record) != self.layout.record_bytes:
            raise ValueError(f"a record has {self.layout.record_bytes} bytes, not {len(record)}")

    @cached_property
    def _record_type(self) -> type[ctypes.Array[ctypes.c_char]]:
        return ctypes.c_char * self.layout.record_bytes

    @cached_property
    def _cycle(self) -> Callable[[Data], int]:
        return self.layout.reader(self.program.cycle)

    def new_context(self, choices: Mapping[str, int] = MappingProxyType({})) -> ctypes.Array[ctypes.c_int64]:
        """A context at its beginning (`backends.native.context`), in which these choices have these values by default.

        Raises ValueError for a value outside its choice's type, KeyError for an unknown choice.
        """
        context: ctypes.Array[ctypes.c_int64] = self._context_type.from_buffer_copy(self._template)
        for name, value in choices.items():
            index = self._choices[name]
            kind = self.program.choices[index].type
            if not kind.low <= value <= kind.high:
                raise ValueError(f"{name} = {value} is outside {kind.low}..{kind.high}")
            context[self._context.defaults + index] = value
        return context

    def _told(self, flat: Sequence[int]) -> Samples:
        """Choices and their values from words that are read with a sign."""
        if not self._unsigned:
            return tuple(zip(flat[::2], flat[1::2], strict=True))
        mask = (1 << 64) - 1
        pairs = zip(flat[::2], flat[1::2], strict=True)
        return tuple((number, value & mask if number in self._unsigned else value) for number, value in pairs)

    def _read_events(self, context: ctypes.Array[ctypes.c_int64]) -> tuple[Event, ...]:
        at = self._context.events
        end, events = at + context[EVENTS], []
        while at < end:
            kind, machine, count = context[at : at + 3]
            events.append((EVENT_KINDS[kind], machine, tuple(context[at + 3 : at + 3 + count])))
            at += 3 + count
        return tuple(events)

    # ------------------------------------------------------------ all steps

    def expand(self, records: Data, count: int, *, chunk_edges: int | None = None) -> Expansion:
        """Every step from `count` records that lie one after the other; `chunk_edges` sets the size of a portion.

        In the order of the records, then of the processes, then of an odometer over the choices that the step reads,
        whose last wheel is the one read last. A record without an enabled process has its stuttering steps.
        """
        return Expansion(self, records, count, chunk_edges)

    def edges(self, records: Data, count: int) -> Iterator[Edge]:
        """The steps of `expand` one by one."""
        return self.expand(records, count).edges()

    def successors(self, record: Data) -> Iterator[Edge]:
        """Every step from one record."""
        return self.expand(record, 1).edges()

    def _expand(
        self,
        records: bytes,
        count: int,
        buffer: ctypes.Array[ctypes.c_char],
        capacity: int,
        context: ctypes.Array[ctypes.c_int64],
    ) -> int:
        code, begin = self._code, perf_counter()
        edges = code.expand(records, count, buffer, capacity, context)
        self.spend(perf_counter() - begin)
        return edges


def _nonzero_seed(seed: int) -> int:
    """SplitMix64 of the seed (G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number generators, 2014), as
    the state of a xorshift generator, which must not be 0."""
    mask = (1 << 64) - 1
    z = seed + 0x9E3779B97F4A7C15 & mask
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & mask
    z = (z ^ z >> 27) * 0x94D049BB133111EB & mask
    z = z ^ z >> 31 or 1
    return z - (1 << 64) if z >> 63 else z
