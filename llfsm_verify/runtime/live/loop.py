"""A program that runs in machine code: its record, the frame that is being made, and the control block."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.native.code import BROKEN
from llfsm_verify.backends.native.context import STATUS, ContextLayout
from llfsm_verify.backends.native.executor import FULL_EFFORT_LINES, NativeProgram, _nonzero_seed
from llfsm_verify.backends.native.machine_code import Effort, MachineCode
from llfsm_verify.checking.monitors import verdicts_of
from llfsm_verify.kripke.observing import initial_atoms
from llfsm_verify.monitoring.code import atom_places, monitor_text
from llfsm_verify.monitoring.lookup import first_states, walk_table
from llfsm_verify.monitoring.states import Monitor
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.control import store, words
from llfsm_verify.runtime.live.frame import (
    COUNTED,
    DETAIL,
    ENDING,
    ENDINGS,
    HEADER_WORDS,
    NUMBER,
    PROCESS,
    STEPS,
    FrameLayout,
)  # fmt: skip
from llfsm_verify.runtime.live.text import live_text
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing, representatives
from llfsm_verify.runtime.stepping.monitored import places
from llfsm_verify.runtime.stepping.visited import state_places, states_of, unvisited
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.values import Value


class Prescribed(NamedTuple):
    """A choice that gets a value before a ringlet, and keeps it."""

    step: int
    """Counted from 0."""
    choice: int
    value: int


class LiveCode:
    """The machine code in which a program runs, with monitors that read its atoms.

    `safe` are values that variables get in the last frame of a run that does not end by itself. ValueError: a monitor
    reads what the program's letters do not show. MonitorTooLarge: see `walk_table`.
    """

    def __init__(
        self,
        program: Program,
        monitors: Mapping[str, Monitor] = MappingProxyType({}),
        safe: Mapping[str, Value] = MappingProxyType({}),
    ) -> None:
        self.program = program
        self.safe = safe
        self.native = NativeProgram(program, events=COUNTED)
        self.layout = self.native.layout
        self.frames = FrameLayout.of(program, self.layout, len(monitors))
        self.context = ContextLayout.of(program, self.layout, self.native.events)
        self.monitors = tuple(monitors)
        self.tables = [walk_table(monitor) for monitor in monitors.values()]
        self.verdicts = [verdicts_of(*pair) for pair in zip(monitors.values(), self.tables, strict=True)]
        """What each state of each monitor means."""
        self.atoms = [monitor.atoms for monitor in monitors.values()]
        shown = places(program, self.native)
        texts = [self.native.text]
        if monitors:
            texts.append(monitor_text(self.tables, [atom_places(atoms, shown) for atoms in self.atoms]))
        texts.append(live_text(self.native, self.frames, self.context, monitors=bool(monitors)))
        text = "\n".join(texts)
        effort: Effort = "quick" if text.count("\n") > FULL_EFFORT_LINES else "thorough"
        self._code = MachineCode(lambda: text, effort, text)
        i32, i64, pointer = ctypes.c_int32, ctypes.c_int64, ctypes.c_void_p
        address = self._code.address
        self.live: Callable[..., int] = ctypes.CFUNCTYPE(i64, pointer, pointer, pointer)(address("live"))
        self.turn: Callable[..., int] = ctypes.CFUNCTYPE(i32, pointer, pointer, pointer, i64)(address("turn"))
        self.commit: Callable[..., None] = ctypes.CFUNCTYPE(None, pointer, pointer)(address("commit"))


class Loop:
    """One run of a program. Nothing of it may be used while `go` runs on another thread, but `stop`.

    Processes that are forked after it is made run one and the same loop: the one whose turn it is.

    `period` and `jitter` are in nanoseconds; a period of 0 is a run without waiting. `free` are values of inputs that
    have any value at first. With `seed` the choices in `drawn` are drawn by `law`, and visited states are noted; the
    others have the values of `held`, else their lowest ones. Raises as `NativeProgram.new_context` for a choice or
    value that there is not, and AtomOverflow where what a monitor reads leaves 64 bits at first.
    """

    def __init__(
        self,
        code: LiveCode,
        *,
        period: int = 0,
        jitter: int | None = None,
        free: Mapping[str, Value] = MappingProxyType({}),
        held: Mapping[str, int] = MappingProxyType({}),
        seed: int | None = None,
        drawn: Iterable[str] = (),
        law: Drawing = ANEW,
        strict: bool = False,
        stops_on_violation: bool = False,
    ) -> None:
        self.code = code
        self.stops_on_violation = stops_on_violation
        """A property that is violated ends the run."""
        layout, frames = code.layout, code.frames
        self._record = words(max(8, layout.record_bytes) // 8)
        self._first = layout.first(free)
        self._put(self._first)
        context = code.native.new_context(held)
        self._context = words(len(context))
        store(context, self._context)
        self.control = words(control.CONTROL_WORDS)
        """The control block (`runtime.live.control`)."""
        self.frame = words(frames.words)
        """The frame that is being made; whole between two calls of `go`."""
        self._previous = words(frames.words)
        self.histogram = words(control.BUCKETS)
        self._states_of = states_of(code.program)
        self._visited = words(max(1, len(self._states_of)))
        self._script: ctypes.Array[ctypes.c_int64] | None = None
        block = {
            control.TURNS: -1, control.PERIOD: period, control.JITTER: period // 2 if jitter is None else jitter,
            control.STRICT: int(strict), control.IMAGE: ctypes.addressof(self.frame),
            control.PREVIOUS: ctypes.addressof(self._previous),
            control.HISTOGRAM: ctypes.addressof(self.histogram), control.LAST: -1, control.ROUNDS: -1,
            control.MINE: -1,
        }  # fmt: skip
        for word, value in block.items():
            self.control[word] = value
        if seed is not None:
            choices, parts = code.program.choices, len(code.program.processes)
            table = law.table(choices, representatives(code.program, set(drawn)), parts)
            self._drawn = words(max(1, len(table)))
            store(table, self._drawn)
            self.control[control.DRAWN] = ctypes.addressof(self._drawn)
            self.control[control.RANDOM] = _nonzero_seed(seed)
            self.control[control.VISITED] = ctypes.addressof(self._visited)
        letter = initial_atoms(code.program, code.layout, self.record)
        first = first_states(code.tables, code.atoms, letter)
        self._states = words(len(first))
        store(first, self._states)
        self.decided = words(len(code.monitors))
        """For each monitor the number of the frame that decided it, or 0."""
        self.control[control.STATES] = ctypes.addressof(self._states)
        self.frame[PROCESS] = -1
        at = code.context.defaults
        self.show(self._context[at : at + len(code.program.choices)])

    def show(self, choices: Sequence[int]) -> None:
        """Let the frame say that choices have these values."""
        store(choices, self.frame, self.code.frames.choices)

    @property
    def record(self) -> bytes:
        """Where the run stands, as the executor's record."""
        return bytes(self._record)[: self.code.layout.record_bytes]

    def _put(self, record: bytes) -> None:
        ctypes.memmove(self._record, record, len(record))

    def prescribe(self, script: Sequence[Prescribed]) -> None:
        """What choices get before certain ringlets, ordered by step, in place of what was prescribed before."""
        flat = [number for line in script for number in line]
        self._script = (ctypes.c_int64 * max(1, len(flat)))(*flat)
        self.control[control.SCRIPT] = ctypes.addressof(self._script)
        self.control[control.SCRIPT_LEFT] = len(script)

    def begin(self, now: int) -> None:
        """Commit the first frame: how things stand before the first turn, which is due at `now` (monotonic, ns)."""
        self.control[control.BASE] = now
        self._visit()
        self.commit()
        self.decide()

    def decide(self) -> None:
        """Write down which monitors have come to a verdict."""
        for number, verdict in enumerate(self.verdicts):
            if verdict != "undecided" and not self.decided[number]:
                self.decided[number] = self.number

    @property
    def states(self) -> tuple[int, ...]:
        """Of the monitors."""
        return tuple(self._states[: len(self.code.monitors)])

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Of each monitor: ``undecided``, ``satisfied`` or ``violated``."""
        return tuple(words[state] for words, state in zip(self.code.verdicts, self._states, strict=False))

    def limit(self, rounds: int) -> None:
        """Let `go` return after so many rounds of turns: so many cycles of logical time."""
        self.control[control.ROUNDS] = rounds

    def go(self, turns: int = -1) -> int:
        """Turns of processes, so many or without an end, until there is a reason to return: it, of `live.control`.

        Raises BrokenProgramError.
        """
        self.control[control.TURNS] = turns
        reason = self.code.live(self._record, self._context, self.control)
        if reason == control.FAILED and self.status == BROKEN:
            raise BrokenProgramError(self.code.program.name)
        return reason

    def _visit(self) -> None:
        for name, begin in state_places(self.code.program):
            self._visited[begin + self.code.layout.get(self.record, name)] = 1

    @property
    def never_visited(self) -> dict[str, tuple[str, ...]] | None:
        """By machine, the states in which it never was; None: it was not noted."""
        if not self.control[control.VISITED]:
            return None
        return unvisited(self._states_of, self._seen)

    @property
    def _seen(self) -> set[tuple[str, str]]:
        return {state for state, seen in zip(self._states_of, self._visited, strict=False) if seen}

    @property
    def status(self) -> int:
        """Of the ringlet that failed: 1 + the number of a fault, or OVERFLOW."""
        return self._context[STATUS]

    def stop(self) -> None:
        """Let `go` return before its next turn; from any thread."""
        self.control[control.STOP] = 1

    def end(self, ending: str, detail: int = 0) -> None:
        """Commit the last frame, which says why there are no more; with safe values, unless it `ended` by itself or
        another loop goes on (`replaced`)."""
        if self.code.safe and ending not in ("ended", "replaced"):
            layout, record = self.code.layout, self.record
            values = layout.encode({**layout.decode(record), **self.code.safe})
            self._put(values)
        self.frame[ENDING] = ENDINGS.index(ending)
        self.frame[DETAIL] = detail
        self.commit()
        self.decide()  # ringlets of a turn that failed count

    def resume(self, newest: Sequence[int] | None) -> None:
        """Go back to the last whole frame after the process that ran the loop was killed in the middle of anything.

        `newest`: the last frame that was published, None where there was none. It may be that a later one is recorded.
        """
        block, frames = self.control, self.code.frames
        log = block[control.LOG]
        recorded = block[control.RECORDED] if log else 0
        if log and block[control.RECORDED_BYTES] != ctypes.c_int64.from_address(log).value:
            recorded = 0  # it was about to be
        if newest is None and not recorded:
            store([0] * frames.words, self._previous)
            store([0] * frames.words, self.frame)
            self.frame[PROCESS] = -1
            at = self.code.context.defaults
            self.show(self._context[at : at + len(self.code.program.choices)])
            self._put(self._first)
            return
        if newest is None or recorded > newest[NUMBER]:
            newest = list(self._previous)
        store(newest, self._previous)
        store(newest, self.frame)
        self._put(frames.record_of(newest))
        store(newest[frames.monitors :], self._states)
        self.decide()

    def begin_at(self, record: bytes, states: Sequence[int]) -> None:
        """Begin in another place than the program does: with this record, and these states of monitors. It is to be
        called before the first frame.
        """
        self._put(record)
        store(states, self._states)

    def take_over(self, before: Loop, record: bytes) -> None:
        """Go on where another loop stands, which does not run, with this record in place of its own.

        It is to be called before the first turn, and commits a frame of the same number. The other loop has as many
        machines, and monitors of the same properties; choices of the same name and type keep their values.
        """
        code, own, other = self.code, self.code.frames, before.code.frames
        names = {choice.name: number for number, choice in enumerate(before.code.program.choices)}
        here, there = code.context.defaults, before.code.context.defaults
        for number, choice in enumerate(code.program.choices):
            source = names.get(choice.name)
            if (
                source is not None
                and before.code.program.choices[source] == choice
                and not choice.name.startswith(OPERATOR)
            ):
                self._context[here + number] = before._context[there + source]
        for word in control.KEPT:
            self.control[word] = before.control[word]
        store(before.histogram, self.histogram)
        store(before.decided, self.decided)
        self._put(record)
        store(before.frame[:HEADER_WORDS], self.frame)
        self.frame[ENDING] = self.frame[DETAIL] = 0
        store(before.frame[other.events : other.monitors], self.frame, own.events)
        store(before._states, self._states)
        self.show(self._context[here : here + len(code.program.choices)])
        self.frame[NUMBER] -= 1
        seen = before._seen
        store([int(state in seen) for state in self._states_of], self._visited)
        self._visit()
        self.commit()

    def perform(self, process: int, choices: Sequence[int], script: Sequence[Prescribed] = ()) -> int:
        """One turn of a process with these values of all choices; the status of its last ringlet.

        The frame is whole after `commit`.
        """
        code = self.code
        at = code.context.defaults
        self._context[at : at + len(choices)] = list(choices)
        slots = len(code.program.slots)
        self.frame[code.frames.fired : code.frames.fired + slots] = [0] * slots
        self.show(choices)
        self.prescribe(script)
        return code.turn(self._record, self._context, self.control, process)

    def commit(self) -> None:
        """Complete the frame, as after `perform`: publish and record it."""
        self.code.commit(self._record, self.control)

    @property
    def steps(self) -> int:
        """Ringlets so far."""
        return self.frame[STEPS]

    @property
    def number(self) -> int:
        """Of the newest frame."""
        return self.frame[NUMBER]

    @property
    def ending(self) -> str:
        """One of `live.frame.ENDINGS`."""
        return ENDINGS[self.frame[ENDING]]
