"""A walk through what was recorded, step by step: where it begins, and its moves one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.replay.confirm import Letter, Schedule, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.kripke.observing import atoms_at
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Get, Local
from llfsm_verify.program.trees import distinct_nodes
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.recording.file import Recording, Turn
from llfsm_verify.runtime.recording.origin import damaged, free_of
from llfsm_verify.runtime.recording.replay import compared, performed, ringlets


@dataclass(frozen=True, slots=True)
class Stood:
    """The last frame of an earlier run: its number, and the record in it with its layout."""

    frame: int
    layout: Layout
    record: bytes


@dataclass(frozen=True, slots=True)
class Start:
    """The configuration in which a walk begins."""

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


@dataclass(frozen=True, slots=True)
class Next:
    """The next step of a walk. `frame`: the number of the frame of a recording that it belongs to. `fails`: it is known
    to end in a fault, so that it may read choices that the walk does not give."""

    move: Move
    frame: int | None = None
    fails: bool = False


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
        """The next step; or why there is no more. Differs: this is not a recording of the arrangement."""
        return next(self._steps, "the recording ends here")

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
