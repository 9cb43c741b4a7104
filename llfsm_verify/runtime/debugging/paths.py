"""Where a debugger begins, and where its steps come from: inputs set by hand, a saved trace, or a recording."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.replay.confirm import Letter, Schedule, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.kripke.observing import atoms_at
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Get, Local, Program
from llfsm_verify.program.trees import distinct_nodes
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.recording.file import Recording, Turn
from llfsm_verify.runtime.recording.origin import damaged, free_of
from llfsm_verify.runtime.recording.replay import Differs, compared, performed, ringlets
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing, Draws, free_inputs, unknown_input
from llfsm_verify.values import ValueProblem, choice_value, value_text


@dataclass(frozen=True, slots=True)
class Stood:
    """The last frame of an earlier run: its number, and the record in it with its layout."""

    frame: int
    layout: Layout
    record: bytes


@dataclass(frozen=True, slots=True)
class Start:
    """The configuration in which a debugger begins."""

    free: tuple[tuple[str, int], ...] = ()
    """Of the beginning of a run: the values of inputs that never change."""
    stood: Stood | None = None

    def record(self, execution: Execution) -> bytes:
        """It, for a program of the arrangement."""
        first = execution.start(self.free)
        if self.stood is None:
            return first
        return self.stood.layout.relaid(self.stood.record, execution.layout, first)

    def letter(self, execution: Execution) -> Letter | None:
        """The atoms that hold there. None: where an earlier run stood, one of them asks for more than a configuration
        tells, such as an input. Raises AtomOverflow."""
        if self.stood is None:
            return first_letter(execution, Schedule(self.free, (), None))
        atoms = execution.program.atoms
        stored = {variable.name for variable in execution.program.vars if not variable.output}
        parts = [node for atom in atoms for node in distinct_nodes(atom.expression)]
        if any(isinstance(n, Local) or (isinstance(n, Get) and n.var not in stored) for n in parts):
            return None
        values = execution.layout.decode(self.record(execution))
        return frozenset(name for name, holds in atoms_at(atoms, values, {}).items() if holds)


class DebugError(Exception):
    """A command cannot be done; the debugger stays where it was. The message says why, and what can be done."""


@dataclass(frozen=True, slots=True)
class Next:
    """The next step of a path. `frame`: the number of the frame of a recording that it belongs to. `fails`: it is known
    to end in a fault, so that it may read choices that the path does not give."""

    move: Move
    frame: int | None = None
    fails: bool = False


class Path(Protocol):
    """Gives the steps of a run one after the other."""

    kind: str
    """What users call it."""

    def next(self, record: bytes, number: int) -> Next | str:
        """The step `number` (from 1), which leads on from `record`; or why the path has no more. DebugError."""


# ---------------------------------------------------------------- inputs are set by hand


class Free:
    """Inputs keep the values that they are given, at first their `init`; processes take turns.

    With a seed, who steps is drawn, and so is all that was not set, by `law`. Otherwise what else a turn chooses
    (ages, `choose`) has its lowest value until it is set.
    """

    kind = "arrangement"

    def __init__(self, execution: Execution, seed: int | None = None, law: Drawing = ANEW) -> None:
        self._execution = execution
        self.program = execution.program
        self._random = None if seed is None else random.Random(seed)  # noqa: S311 - a reproducible sequence is wanted
        self._draws = Draws(law, len(self.program.slots))
        self.settable = _settable(self.program)
        """By the names of users: what can be set."""
        self.held: dict[str, int] = {}
        """By the names of `settable`: what was set."""
        self.turn: int | None = None
        """The process that takes the next step, if that was said."""
        self.last: int | None = None
        """The process that took the last step."""
        self._inits = _inits(self.program)

    def set(self, name: str, text: str) -> None:
        """Give an input or a choice a value, from the next step on. DebugError: there is no such input or value."""
        choice = self._known(name)
        try:
            self.held[name] = choice_value(choice, text)
        except ValueProblem as problem:
            raise DebugError(f"{name}: {problem}") from None

    def release(self, name: str) -> None:
        """Take back what was set."""
        self._known(name)
        self.held.pop(name, None)

    def _known(self, name: str) -> Choice:
        if name not in self.settable:
            if any(v.name == name and v.origin.kind == "input" for v in self.program.vars):
                raise DebugError(unknown_input(self.program, name))
            known = ", ".join(self.settable) or "none"
            raise DebugError(f"there is no input `{name[:60]}`; what can be set: {known}")
        return self.settable[name]

    def value(self, name: str) -> str:
        """The text of what an input or a choice will be in the next step."""
        choice = self.settable[name]
        if name in self.held:
            return value_text(choice.type, choice.labels, self.held[name])
        if self._random is not None:
            return "drawn"
        return value_text(choice.type, choice.labels, self._inits[name])

    def next(self, record: bytes, number: int) -> Next | str:  # noqa: ARG002 - steps have no numbers here
        enabled = self._execution.enabled(record)
        if not enabled:
            return "the arrangement has ended"
        if self.turn is not None and self.turn not in enabled:
            name = self.program.processes[self.turn].name
            raise DebugError(f"process `{name}` has ended; `turn` names another one")
        given = self.held
        values = {name: given.get(name, self._inits[name]) for name in self.settable}
        if self._random is not None:
            left = {choice.name: name for name, choice in self.settable.items() if name not in given}
            drawn = self._draws.next([self.settable[name] for name in left.values()], self._random)
            values |= {left[name]: value for name, value in drawn.items()}
        choices = {c.name: values[c.source] for c in self.program.choices}
        for name, value in values.items():
            choices.setdefault(name, value)  # inputs that only formulas read
        return Next(Move(self._process(enabled), choices))

    def _process(self, enabled: list[int]) -> int:
        if self.turn is not None:
            process, self.turn = self.turn, None
            return process
        if self._random is not None:
            return self._random.choice(enabled)
        count, after = len(self.program.processes), 0 if self.last is None else self.last + 1
        return min(enabled, key=lambda p: (p - after) % count)


def _settable(program: Program) -> dict[str, Choice]:
    found: dict[str, Choice] = {}
    for choice in program.choices:
        found.setdefault(choice.source, choice)
    for one in program.inputs:
        found.setdefault(one.name, Choice(one.name, one.type, "input", one.name, one.labels))
    return found


def _inits(program: Program) -> dict[str, int]:
    inits: dict[str, int] = {i.name: i.init for i in program.inputs}
    for var in program.vars:
        if var.origin.kind == "input" and isinstance(var.init, int):
            inits.setdefault(var.name, var.init)
    for choice in program.choices:
        inits.setdefault(choice.source, choice.type.low)
    return inits


def free_value(program: Program, name: str, text: str) -> int | None:
    """The value of an input that never changes and has no `init`; None: there is no such input. DebugError."""
    choice = free_inputs(program).get(name)
    if choice is None:
        return None
    try:
        return choice_value(choice, text)
    except ValueProblem as problem:
        raise DebugError(f"{name}: {problem}") from None


# ---------------------------------------------------------------- what has happened


class Traced:
    """The steps of a saved trace; those of its loop again and again."""

    kind = "trace"

    def __init__(self, schedule: Schedule, *, fails: bool) -> None:
        self._schedule = schedule
        self._fails = fails

    def next(self, record: bytes, number: int) -> Next | str:  # noqa: ARG002 - a path of its own needs no record
        moves, loop = self._schedule.ringlets, self._schedule.loop
        at = number - 1
        if at >= len(moves):
            if loop is None:
                return "the trace ends here"
            at = loop + (at - loop) % (len(moves) - loop)
        return Next(moves[at], None, self._fails and at == len(moves) - 1)


class Recorded:
    """The ringlets of a recording, each turn performed again in the machine code of the run, and found the same."""

    kind = "recording"

    def __init__(self, recording: Recording, code: LiveCode) -> None:
        """DiagnosticError (E481, E482): the recording does not say how it began, or nothing can begin so."""
        self._recording = recording
        self._code = code
        self._ending = 0
        self._turns = self._noticed()
        stood, done = None, 0
        if recording.goes_on:
            with compared(recording):
                first = next(self._turns, None)
            if first is None:
                raise damaged(recording, "it has no frame, which would say where an earlier run stood")
            stood = Stood(first.frame[NUMBER], code.layout, code.frames.record_of(first.frame))
            done = first.frame[STEPS]
        self.start = Start(tuple(free_of(recording, code.program).items()), stood)
        self._steps = self._all(done)

    def next(self, record: bytes, number: int) -> Next | str:  # noqa: ARG002 - a path of its own needs no record
        try:
            return next(self._steps, "the recording ends here")
        except Differs as differs:
            raise DebugError(f"this is not a recording of this arrangement: {differs}") from None

    def _noticed(self) -> Iterator[Turn]:
        for turn in performed(self._recording, self._code):
            self._ending = turn.frame[ENDING]
            yield turn

    def _all(self, done: int) -> Iterator[Next | str]:
        if self.start.stood is None:
            next(self._turns, None)
        for ringlet in ringlets(self._turns, self._code, done=done):
            yield Next(*ringlet)
        if ENDINGS[self._ending] not in ("running", "ended"):
            yield f"the recording ends here: {ENDINGS[self._ending]}"
        if self._recording.damaged:
            yield f"the recording is damaged after this: {self._recording.damaged}"
        if self._recording.lost:
            yield f"the recording ends here: {self._recording.lost}"
        while True:
            yield "the recording ends here"
