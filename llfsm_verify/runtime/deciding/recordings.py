"""Properties decided on a recording: what it violates, what it satisfies, and what it leaves open."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Literal, TypeVar

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.monitors import monitors_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.replay.confirm import Letter, Schedule, atoms_of, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.program.program import Local, Program
from llfsm_verify.program.trees import distinct_nodes
from llfsm_verify.runtime.live.frame import STEPS
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.recording.file import Recording, Turn
from llfsm_verify.runtime.recording.origin import code_of, free_of
from llfsm_verify.runtime.recording.replay import performed, ringlets

Decision = Literal["violated", "satisfied", "undecided"]


@dataclass(frozen=True, slots=True)
class Decided:
    """What a recording says of a property."""

    line: Property
    verdict: Decision
    step: int | None = None
    """The ringlet after which it is decided, from 1; 0: before the first one; None: by the whole run, or not at all."""
    frame: int | None = None
    """The number of the frame of that ringlet's cycle."""
    reason: str = ""
    """Why it is undecided."""
    time: str | None = None
    """Of a log that has times: that of the row."""
    deadline: str | None = None
    """The end of the time by which it is decided, where that is before the row."""


def check(arrangement: Arrangement, properties: PropertySet, recording: Recording) -> list[Decided]:
    """Each property, on a recording of this arrangement (as it ran: without the model of its surroundings, if so).

    The run is performed again ringlet by ringlet, with the letters that the verifier reads. A verdict by a finite part
    holds whatever came after. An arrangement that has ended repeats its last letter forever, so everything is decided
    of it but what speaks of inputs, which may change after the end; what is open at the end of a run that was stopped,
    failed or was killed is undecided. Of a recording that goes on with an earlier one, properties are decided as if
    everything began with its second frame. DiagnosticError: wrong properties, or a damaged recording. Differs: this is
    no recording of this arrangement.
    """
    problem = bind(arrangement, properties)
    program = problem.program(keep_all_bits=True)
    code = code_of(recording, arrangement)
    free = free_of(recording, code.program)
    watches = watches_of(problem, Watch)
    run = _Performed(program, code, tuple(free.items()), goes_on=recording.goes_on)
    turns = performed(recording, code)
    ended = run.run(turns, watches)
    deque(turns, 0)  # up to the end of the file, which may be damaged
    if ended and any(watch.verdict == "undecided" for watch in watches):
        run.letters = []
        run.run(performed(recording, code), ())  # once more: most recordings do not need their letters
        stem, loop = run.letters[:-1], run.letters[-1:]
        assumed = all(claim_of(p, problem.clock).true_on(stem, loop) for p in properties.assumptions)
        parts = ((atom.name, node) for atom in program.atoms for node in distinct_nodes(atom.expression))
        worldly = {name for name, node in parts if isinstance(node, Local) and node.name.startswith("input:")}
        given = {name for p in properties.assumptions for name in p.atoms}
        for watch in watches:
            if worldly & {*watch.goal.atoms, *given}:
                watch.reason = "inputs may change after the end"
            else:
                watch.decide_on_lasso(stem, loop, assumed=assumed)
    open_end = "the recording ended before a verdict"
    if run.overflow:
        open_end = run.overflow
    elif recording.damaged or recording.lost:
        open_end += f": {recording.damaged or recording.lost}"
    return [watch.decided(open_end=open_end) for watch in watches]


class Watch:
    """A property and what is known of it so far."""

    def __init__(self, goal: Goal, monitor: Monitor | None, reason: str = "") -> None:
        self.goal = goal
        self.monitor = monitor
        self.state = 0
        self.verdict: Decision = "undecided"
        self.place: tuple[int, int] | None = None
        self.reason = reason

    def copied(self) -> Watch:
        """The same, which then reads for itself."""
        return copy(self)

    def read(self, letter: Letter, step: int, frame: int) -> None:
        if self.monitor is None or self.verdict != "undecided":
            return
        self.state = self.monitor.step(self.state, self.monitor.letter(letter))
        verdict = self.monitor.verdicts[self.state]
        if verdict in (MonitorVerdict.FALSE, MonitorVerdict.TRUE):
            self.verdict = "violated" if verdict is MonitorVerdict.FALSE else "satisfied"
            self.place = step, frame

    def decide_on_lasso(self, stem: Sequence[Letter], loop: Sequence[Letter], *, assumed: bool) -> None:
        """The run goes round the loop forever."""
        if self.verdict == "undecided":
            try:
                self.verdict = "violated" if assumed and self.goal.violated_by(stem, loop) else "satisfied"
            except Unconfirmed as error:
                self.reason = str(error)

    def decided(self, *, open_end: str) -> Decided:
        """What became of it; `open_end` is why the run says no more."""
        step, frame = self.place or (None, None)
        if self.monitor is not None and self.monitor.hopeless[self.state]:
            open_end = "no finite part of a run decides it"
        reason = self.reason or open_end if self.verdict == "undecided" else ""
        return Decided(self.goal.line, self.verdict, step, frame, reason)


W = TypeVar("W", bound=Watch)


def watches_of(problem: Problem, kind: type[W]) -> list[W]:
    """The properties of a problem, of which nothing is known so far."""
    monitors, reasons = monitors_of(problem)
    return [kind(goal, monitors.get(goal.line.name), reasons.get(goal.line.name, "")) for goal in goals_of(problem)]


class _Performed:
    """A recording performed with the program that shows the letters of the properties."""

    def __init__(
        self, program: Program, code: LiveCode, free: tuple[tuple[str, int], ...], *, goes_on: bool = False
    ) -> None:
        self._free = free
        self._code = code
        self._goes_on = goes_on
        self._execution = Execution(program)
        self._by_cycle = program.observe == "cycle"
        self._cycle = self._execution.layout.reader(program.cycle)
        self.letters: list[Letter] | None = None
        """All letters, where there is a list for them."""
        self.overflow = ""
        """What left 64 bits, so that no letter is known from there on."""

    def run(self, turns: Iterable[Turn], watches: Sequence[Watch]) -> bool:
        """Whether the arrangement has ended by itself: the last letter then repeats forever."""
        turns = iter(turns)
        first = next(turns, None)
        execution, record, step = self._execution, self._execution.start(self._free), 0
        if self._goes_on:
            if first is None:
                return False
            # The letter that was made there is not known any more.
            stood = self._code.frames.record_of(first.frame)
            record, step = self._code.layout.relaid(stood, execution.layout, record), first.frame[STEPS]
        else:
            try:
                self._read(first_letter(execution, Schedule(self._free, (), None)), watches, 0, 1)
            except OverflowError as overflow:
                self.overflow = f"{overflow} in the initial configuration"
                return False
        for move, frame, fails in ringlets(turns, self._code, execution.program, step):
            if fails:
                return False
            result = execution.step(record, move)
            step += 1
            if result.status:
                self.overflow = f"what a property reads leaves 64 bits in step {step:,}"
                return False
            record = result.record
            if move.process is None or not self._by_cycle or self._cycle(record):
                self._read(atoms_of(execution, record), watches, step, frame)
            if move.process is None:
                return True
        return False

    def _read(self, letter: Letter, watches: Sequence[Watch], step: int, frame: int) -> None:
        if self.letters is not None:
            self.letters.append(letter)
        for watch in watches:
            watch.read(letter, step, frame)
