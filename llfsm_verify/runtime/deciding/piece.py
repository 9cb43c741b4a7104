"""A recording, from its beginning to some ringlet, as a saved trace that tests perform again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule, perform
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Disagreement, counted
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.runtime.deciding.recordings import Decided, check
from llfsm_verify.runtime.recording import UNSAVED
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of, free_of
from llfsm_verify.runtime.recording.replay import Ringlet, performed, ringlets
from llfsm_verify.verification.replay import replay
from llfsm_verify.verification.tracefile import Expected, SavedProperty, document_of, saved_text


@dataclass(frozen=True, slots=True)
class Piece:
    """The text of a trace file, and what it shows, in a sentence."""

    text: str
    sentence: str


def piece_of(
    recording: Recording,
    arrangement: Arrangement,
    properties: PropertySet,
    directory: Path,
    last: int | None = None,
) -> Piece:
    """The first `last` ringlets of a recording (None: all) as a trace file for `directory`, of the one property that is
    given with its assumptions; of none: of the fault that they end in.

    A piece that violates the property ends there (`expect: violated`), or goes on forever where the arrangement has
    ended; any other one is whole (`expect: holds`). `arrangement` is as its file has it, and its executor performs the
    piece before anything is written.

    DiagnosticError (E488): it is no run of `arrangement` from the beginning, or fails in nothing. Differs: the
    recording is of another one.
    """
    if recording.goes_on:
        raise _unsaved(recording, "it continues an earlier recording, but a saved trace begins where a run begins",
                       "take the piece from the first recording of the run")  # fmt: skip
    ran = arrangement_of(recording, lambda _: arrangement, arrangement.path)
    if ran.plants != arrangement.plants:
        raise _unsaved(recording, "it was made without the model of the surroundings that the arrangement has",
                       "record with --simulate, or name an arrangement without `environment:`")  # fmt: skip
    run = _Run(recording, ran, arrangement, properties, directory)
    return run.failing(last) if not properties.goals else run.checked(last)


class _Run:
    def __init__(
        self,
        recording: Recording,
        ran: Arrangement,
        arrangement: Arrangement,
        properties: PropertySet,
        directory: Path,
    ) -> None:
        self._recording = recording
        self._ran = ran
        self._arrangement = arrangement
        self._properties = properties
        self._directory = directory
        self._code = code_of(recording, ran)
        self._free = tuple(free_of(recording, self._code.program).items())

    def failing(self, last: int | None) -> Piece:
        """Of the fault at the end."""
        taken = self._taken(last)
        if not taken or not taken[-1].fails:
            raise _unsaved(self._recording, f"no fault ends {_piece(last)}, and no property says what it shows",
                           "name a property: -p 'G !(a@RUN && b@RUN)'")  # fmt: skip
        execution = Execution(bind(self._arrangement, PropertySet()).program(keep_all_bits=True))
        trace = perform(execution, self._schedule(taken), frozenset(), open_end=True).trace
        if trace.fault is None:
            raise _unsaved(self._recording, "a value leaves 64 bits at its end, which no saved trace shows")
        text = document_of(trace, self._arrangement, trace.fault, self._properties, self._directory, "violated")
        return Piece(text, f"a fault ends {counted(len(taken), 'step')}: {trace.fault.message} (expect: violated)")

    def checked(self, last: int | None) -> Piece:
        """Of the property."""
        (line,) = self._properties.goals
        (decided,) = check(self._ran, self._properties, self._recording)
        taken = [ringlet for ringlet in self._taken(last) if not ringlet.fails]
        schedule = self._schedule(taken)
        violated = decided.verdict == "violated" and decided.step is not None and decided.step <= len(taken)
        if violated:
            schedule = replace(schedule, ringlets=schedule.ringlets[: decided.step])
        elif _forever(decided, taken):
            violated = decided.verdict == "violated"
            schedule = replace(schedule, loop=len(taken) - 1)
        done = replay(self._arrangement, self._properties, schedule)
        if done.outcome == "misfit" or done.trace is None:
            raise _unsaved(self._recording, f"{self._arrangement.path} does not perform {_piece(last)}: {done.reason}")
        fails = done.outcome == "fails"
        if fails != violated and not self._properties.assumptions:
            raise Disagreement(
                f"property {line.name}: the recording says {decided.verdict}, and the trace {done.reason}"
            )
        expect: Expected = "violated" if fails else "holds"
        text = self._document(done.trace, expect)
        steps = counted(len(schedule.ringlets), "step")
        if fails:
            return Piece(text, f"{line.name} is violated by {steps} (expect: violated)")
        because = f", since {done.reason}" if violated else ""
        return Piece(text, f"{line.name} is not violated by {steps}{because} (expect: holds)")

    def _document(self, trace: Trace, expect: Expected) -> str:
        (line,) = self._properties.goals
        assert line.kind != "assume", "goals are not assumed"
        what = SavedProperty(line.name, line.kind, saved_text(line, self._directory))
        return document_of(trace, self._arrangement, what, self._properties, self._directory, expect)

    def _taken(self, last: int | None) -> list[Ringlet]:
        """The ringlets of the piece; all of them are performed, and the whole recording is compared."""
        program = bind(self._ran, self._properties).program(keep_all_bits=True)
        turns = performed(self._recording, self._code)
        next(turns, None)
        return list(islice(ringlets(turns, self._code, program), last))

    def _schedule(self, taken: Sequence[Ringlet]) -> Schedule:
        return Schedule(self._free, tuple(ringlet.move for ringlet in taken), None)


def _forever(decided: Decided, taken: Sequence[Ringlet]) -> bool:
    """Whether the verdict is that of the whole run, which has ended."""
    whole = bool(taken) and taken[-1].move.process is None
    return whole and decided.step is None and decided.verdict != "undecided"


def _piece(last: int | None) -> str:
    return "the recording" if last is None else f"this piece (up to step {last:,})"


def _unsaved(recording: Recording, why: str, hint: str | None = None) -> DiagnosticError:
    message = f"the recording cannot be saved as a trace: {why}"
    return DiagnosticError([Diagnostic(UNSAVED, message, file=str(recording.path), hint=hint)])
