"""A trace file run again: what happens now, beside what the file expects."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.logic.properties import PropertySet, asked_text, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import ValueProblem, choice_value
from llfsm_verify.verification.query import NAME, saved_query
from llfsm_verify.verification.replaying import Replay, replay
from llfsm_verify.verification.tracefile import TraceFile, profile_words, read_trace_file


@dataclass(frozen=True, slots=True)
class Replayed:
    """A trace file, the arrangement that it was run on, and what came out."""

    file: TraceFile
    arrangement: Arrangement
    replay: Replay

    @property
    def found(self) -> Literal["violated", "holds"] | None:
        """What `expect:` would have to say; None: the trace no longer fits."""
        return {"fails": "violated", "passes": "holds", "misfit": None}[self.replay.outcome]

    @property
    def asked(self) -> str | None:
        """What a saved query asked for; None: the run is none of a query. Reaching it is no failure."""
        goal = self.file.goal
        return None if goal is None else saved_query(goal.name, goal.kind, goal.text)

    @property
    def title(self) -> str:
        """The property with its text, what a query asked for, or the fault."""
        if self.asked is not None:
            return f"{NAME}: {self.asked}"
        if self.file.goal is not None:
            return f"{self.file.goal.name}: {asked_text(self.file.goal.kind, self.file.goal.text)}"
        assert self.file.fault is not None
        return f"{self.file.fault[0]}: {self.file.fault[1]}"

    @property
    def sentence(self) -> str:
        """Whether the failure still happens, and why we say so."""
        reason = self.replay.reason
        if self.replay.outcome == "misfit":
            return f"does not fit any more: {reason}"
        expected = "" if self.file.expect == "violated" else " (expected: holds)"
        if self.asked is not None:
            reaches = "still reaches it" if self.replay.outcome == "fails" else "does not reach it any more"
            return f"the run {reaches}{expected}"
        happens = "still happens" if self.replay.outcome == "fails" else "does not happen any more"
        return f"the failure {happens}: {reason}{expected}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What has changed since the trace was saved."""
        notes = []
        if self.arrangement.digest != self.file.digest:
            notes.append("the arrangement has changed since the trace was saved")
        if self.file.profile != profile_words(self.arrangement.profile):
            notes.append("the arrangement has another profile than when the trace was saved")
        return tuple(notes)


class Load(Protocol):
    """Loads an arrangement; `named_at` is the place in a file where its path stands."""

    def __call__(self, path: str, /, *, named_at: Span | None = None) -> Arrangement: ...


def replay_file(path: str, arrangement_path: str | None, load: Load, *, chosen: bool = False) -> Replayed:
    """Run the trace file at `path` again, on the arrangement that it names unless `arrangement_path` names another.

    `chosen`: the path is not the user's own words, so only a regular file is read there.
    With `expect: holds`, choices that the run does not give are completed (`checking.replay.saved`). Raises
    DiagnosticError: what reading the file and loading the arrangement can raise, a trace whose arrangement did not come
    from a file (E410), a process or value that the arrangement does not have (E411).
    """
    file = read_trace_file(path, chosen=chosen)
    arrangement = _arrangement(file, arrangement_path, load)
    properties = _properties(file)
    schedule = schedule_of(file, arrangement, properties)
    done = replay(arrangement, properties, schedule, file.fault, complete=file.expect == "holds")
    return Replayed(file, arrangement, done)


def saved_run(path: str, arrangement_path: str | None, load: Load) -> tuple[TraceFile, Arrangement, Schedule]:
    """The trace file at `path`, its arrangement (the one that it names, unless another is), and the run that it has.

    Nothing is performed. DiagnosticError: as for `replay_file`.
    """
    file = read_trace_file(path)
    arrangement = _arrangement(file, arrangement_path, load)
    return file, arrangement, schedule_of(file, arrangement)


def _arrangement(file: TraceFile, arrangement_path: str | None, load: Load) -> Arrangement:
    return load(arrangement_path) if arrangement_path else load(_arrangement_path(file), named_at=file.place)


def _arrangement_path(file: TraceFile) -> str:
    if file.from_stdin:
        hint = "name it with --arrangement FILE"
        message = "the arrangement of this trace did not come from a file"
        raise DiagnosticError(Diagnostic("E410", message, hint=hint, file=file.path))
    return file.arrangement_path


def _properties(file: TraceFile) -> PropertySet:
    """The property and its assumptions as they are written in the trace file."""
    lines = {name: f"assume {name}: {text}" for name, text in file.assumptions}
    if file.goal is not None:
        kind = "" if file.goal.kind == "ltl" else f"{file.goal.kind} "
        text = file.goal.text
        if file.goal.names_a_file:
            text = f'"{Path(file.path).parent.absolute() / text}"'
        lines[file.goal.name] = f"{kind}{file.goal.name}: {text}"
    where, syntaxes = f"the property in {file.path}", dict(file.syntaxes)
    # One source each: their syntaxes may differ.
    sources = [
        Source(where, f"# syntax: {syntaxes[name]}\n{line}" if name in syntaxes else line)
        for name, line in lines.items()
    ]
    return parse_properties(sources, features=CHECKED)


def schedule_of(file: TraceFile, arrangement: Arrangement, properties: PropertySet | None = None) -> Schedule:
    """The choices as numbers; DiagnosticError (E411) for a process, or a value, that the arrangement does not have.

    `properties`: those of the file, where they are read already.
    """
    properties = _properties(file) if properties is None else properties
    program = lower(arrangement, bind(arrangement, properties).atoms)
    processes = {process.name: i for i, process in enumerate(program.processes)}
    choices = {choice.name: choice for choice in program.choices}
    moves: list[Move] = []
    for number, step in enumerate(file.steps, 1):
        if step.process is not None and step.process not in processes:
            message = f"step {number}: there is no process `{step.process}` any more"
            raise DiagnosticError(Diagnostic("E411", message, step.span))
        values: dict[str, int] = {}
        for name, text in step.choices:
            # A choice that is gone is no misfit by itself: the arrangement may have stopped reading that input.
            if name not in choices:
                continue
            try:
                values[name] = choice_value(choices[name], text)
            except ValueProblem as problem:
                raise DiagnosticError(Diagnostic("E411", f"step {number}: {name}: {problem}", step.span)) from None
        moves.append(Move(None if step.process is None else processes[step.process], values))
    return Schedule(file.free, tuple(moves), file.loop)
