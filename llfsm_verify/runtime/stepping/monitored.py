"""A simulation with monitors beside it: every letter of a run in machine code is read where it is made."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.native.code import BROKEN
from llfsm_verify.backends.native.context import DRAWN, ENDED, PROCESS, RANDOM, STATUS, ContextLayout
from llfsm_verify.backends.native.executor import FULL_EFFORT_LINES, RUN_PORTION, Event, NativeProgram, _nonzero_seed
from llfsm_verify.backends.native.loops import Between, fill, run_loop
from llfsm_verify.backends.native.machine_code import MachineCode
from llfsm_verify.kripke.observing import initial_atoms
from llfsm_verify.monitoring.code import Place, atom_places, monitor_text
from llfsm_verify.monitoring.lookup import Stepping, first_states, walk_table
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing
from llfsm_verify.runtime.stepping.simulation import Simulation, SimulationOverflow
from llfsm_verify.values import Shown

FOR_EVER = 1 << 62
"""More ringlets than any run takes."""
LONG_RUN = 100_000
"""A run of so many ringlets is worth compiling for quick steps."""


class MonitoredSimulation(Simulation):
    """A simulation whose monitors read the observed word, the initial letter included, in every kind of step.

    `monitors` read atoms of the program. Setting `record` does not undo what they have read. Runs are those of
    `Simulation` with the same seed.
    """

    def __init__(
        self, program: Program, monitors: Mapping[str, Stepping], seed: int | None = None, law: Drawing = ANEW
    ) -> None:
        """ValueError: a monitor reads what the program's letters do not show. MonitorTooLarge: see `walk_table`.
        SimulationOverflow: what a monitor reads leaves 64 bits in the first configuration."""
        native = NativeProgram(program, events=True)
        self.names = tuple(monitors)
        self._tables = [walk_table(monitor) for monitor in monitors.values()]
        self._back = [table.states for table in self._tables]
        shown = places(program, native)
        own = [atom_places(monitor.atoms, shown) for monitor in monitors.values()]
        self._context_layout = ContextLayout.of(program, native.layout, native.events)
        self._text = "\n".join(
            [native.text, monitor_text(self._tables, own), _watch_text(native, self._context_layout)]
        )
        self._compiled: dict[bool, _WatchCode] = {}  # by whether for a quick start; shared with those made `anew`
        self._by_cycle = program.observe == "cycle"
        self._atoms = [monitor.atoms for monitor in monitors.values()]
        super().__init__(native, seed, law)

    def _begin(self, seed: int | None, free: Mapping[str, int]) -> None:
        super()._begin(seed, free)
        try:
            letter = initial_atoms(self.program, self._layout, self.record)
        except OverflowError:
            raise SimulationOverflow from None
        self._states = first_states(self._tables, self._atoms, letter)
        self.settled: dict[str, int] = {}
        """The monitors that are settled (in a state that is never left), each with the ringlets taken until then."""
        self._note()

    @property
    def monitor_states(self) -> dict[str, int]:
        """The state of each monitor, by its own numbers."""
        return {name: self._back[k][self._states[k]] for k, name in enumerate(self.names)}

    def run(self, ringlets: int, inputs: Mapping[str, Shown] | None = None, *, stop: bool = False) -> int:
        """As `Simulation.run`, with the monitors; `stop`: as soon as one of them becomes settled."""
        return self._watched(ringlets, -1, inputs, stop)[0]

    def hold(
        self, inputs: Mapping[str, Shown], *, ringlets: int | None = None, cycles: int | None = None
    ) -> tuple[int, int]:
        """Go on with these inputs until a monitor becomes settled, the arrangement has ended, or one of the limits.

        At least one limit is given. Returns the number of ringlets taken and that of cycles completed. Errors as for
        `run`.
        """
        if ringlets is None and cycles is None:
            raise ValueError("a number of ringlets or of cycles is needed")
        return self._watched(
            FOR_EVER if ringlets is None else ringlets, -1 if cycles is None else cycles, inputs, stop=True
        )

    def _watched(self, ringlets: int, cycles: int, inputs: Mapping[str, Shown] | None, stop: bool) -> tuple[int, int]:
        """Ringlets taken and cycles completed; a negative number of `cycles` is no limit."""
        chosen, left = self._held(inputs), ctypes.c_int64(cycles)
        code = self._code(quick=ringlets < LONG_RUN or self._text.count("\n") > FULL_EFFORT_LINES)
        turn, state, rows = self._turn, 0, list[int]()
        if self._random is not None:
            turn, state = 0, _nonzero_seed(self._random.getrandbits(64))
            chosen, rows = self._draws.in_code(self.program, self._random)
        table = (ctypes.c_int64 * max(1, len(rows)))(*rows)
        context = self._native.new_context(chosen)
        context[PROCESS], context[RANDOM], context[DRAWN] = turn, state, ctypes.addressof(table) if rows else 0
        size = self._layout.record_bytes
        buffer = (ctypes.c_char * size).from_buffer_copy(self.record)
        done, begin = 0, self.steps
        while done < ringlets and left.value:
            done += code.watch(buffer, min(RUN_PORTION, ringlets - done), self._states, context, ctypes.byref(left))
            self.steps = begin + done
            if (self._note() and stop) or context[STATUS]:
                break
        status, at = context[STATUS], self._context_layout.defaults
        self._draws.note(self.program.choices, context[at : at + len(self.program.choices)])
        self.record, self.events = buffer.raw, ()
        self._turn = context[PROCESS] % max(1, len(self.program.processes))
        if status == BROKEN:
            raise BrokenProgramError(self.program.name)
        if status != ENDED:
            self._raise(status)
        return done, cycles - left.value

    def _ringlet(self, chosen: Mapping[str, int], process: str | None) -> tuple[Event, ...]:
        stutters = self.ended
        events = super()._ringlet(chosen, process)
        if stutters or not self._by_cycle or self._cycle(self.record):
            data = (ctypes.c_char * self._layout.record_bytes).from_buffer_copy(self.record)
            self._code(quick=True).look(data, self._states)
            self._note()
        return events

    def _code(self, *, quick: bool) -> _WatchCode:
        found = self._compiled.get(False) or (self._compiled.get(True) if quick else None)
        if found is None:
            found = self._compiled[quick] = _WatchCode(self._text, quick)
        return found

    def _note(self) -> bool:
        """Write down which monitors are newly settled; whether there are some."""
        new = False
        for k, (name, table) in enumerate(zip(self.names, self._tables, strict=True)):
            if name not in self.settled and self._states[k] >= table.settled:
                self.settled[name] = self.steps
                new = True
        return new


def places(program: Program, native: NativeProgram) -> dict[str, Place]:
    """Where records show the atoms. A Bool takes a bit."""
    return {atom.name: native.layout.fields[atom.output].place(0) for atom in program.atoms}


class _WatchCode:
    """The program and its monitors in machine code."""

    def __init__(self, text: str, quick: bool) -> None:
        self._code = MachineCode(lambda: text, "quick" if quick else "thorough")
        i32, i64, pointer = ctypes.c_int32, ctypes.c_int64, ctypes.c_void_p
        watch = ctypes.CFUNCTYPE(i64, pointer, i64, pointer, pointer, pointer)
        self.watch: Callable[..., int] = watch(self._code.address("watch"))
        self.look: Callable[..., int] = ctypes.CFUNCTYPE(i32, pointer, pointer)(self._code.address("look"))


def _watch_text(native: NativeProgram, context: ContextLayout) -> str:
    """`@watch`: as `@run`, with the monitors, ended by a newly settled one as well, and when as many cycles are over
    as its last argument points to (which it counts down); `@look`: the letter of one record."""
    by_cycle = native.program.observe == "cycle"
    numbers = {
        "RECORD": native.layout.record_bytes, "PROCESSES": len(native.program.processes), "SAVED": context.saved,
    }  # fmt: skip
    shown = f"%closed = or i1 %complete, {'false' if by_cycle else 'true'}"
    return fill(f"{_LOOK}\n{run_loop('watch', _MONITORED)}".replace("<SHOWN>", shown), numbers)


_LOOK = """\
define i32 @look(ptr noalias %r, ptr noalias %states) #1 {
  %new = call i1 @monitors(ptr %r, ptr %states)
  %new.32 = zext i1 %new to i32
  ret i32 %new.32
}"""
_MONITORED = Between(
    parameters="ptr noalias %states, ptr noalias %c, ptr noalias %cycles",
    before="""
  %k.first = load i64, ptr %cycles""",
    carried="""
  %k = phi i64 [%k.first, %entry], [%k.next, %on]""",
    enough="""
  %full = icmp uge i64 %n, %steps
  %all = icmp eq i64 %k, 0
  %enough = or i1 %full, %all""",
    end="""
  %last = call i1 @monitors(ptr %r, ptr %states)""",
    leave="""
  store i64 %k, ptr %cycles""",
    after="""
  %complete = call i1 @cycle(ptr %r)
  %one = zext i1 %complete to i64
  %k.next = sub i64 %k, %one
  <SHOWN>
  br i1 %closed, label %read, label %on
read:
  %new = call i1 @monitors(ptr %r, ptr %states)
  br i1 %new, label %out.read, label %on
out.read:
  store i64 %k.next, ptr %cycles
  ret i64 %n.next""",
)
