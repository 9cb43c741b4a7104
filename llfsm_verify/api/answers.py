"""Answers to queries, findings of lint, coverage, and what replays of saved traces say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.analysis.coverage.result import Coverage, Judged
from llfsm_verify.analysis.lint.finding import Finding, LintResult, OpenQuestion
from llfsm_verify.api.traces import Readable, RunView, TraceView
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Proof
from llfsm_verify.jsonvalue import Json
from llfsm_verify.verification.query import QueryResult
from llfsm_verify.verification.replay import Replayed

if TYPE_CHECKING:
    from rich.console import RenderableType

    from llfsm_verify.runtime.recording.repeating import Repeated


class Reachability(StrEnum):
    """What a query finds out."""

    REACHED = "reached"
    UNREACHABLE = "unreachable"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, repr=False)
class QueryAnswer(Readable):
    """Whether a run reaches what was asked for. `wrapped` is the value inside, which is private."""

    wrapped: QueryResult
    _arrangement: Arrangement

    def __bool__(self) -> bool:
        """TypeError: *unknown* is neither."""
        raise TypeError("an answer is neither true nor false: ask for its answer")

    def __repr__(self) -> str:
        return f"<QueryAnswer {self.answer}: {self.wrapped.query.text}>"

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.query import query_text

        return query_text(self.wrapped)

    @property
    def answer(self) -> Reachability:
        """``reached``, ``unreachable`` or ``unknown``; it is also a str."""
        return Reachability(self.wrapped.word)

    @property
    def trace(self) -> TraceView | None:
        """A shortest run that the engine found to it."""
        trace, query = self.wrapped.trace, self.wrapped.query
        if trace is None:
            return None
        return TraceView(trace, self._arrangement, query.properties, query.properties.goals[0], _of_query=True)

    @property
    def reason(self) -> str | None:
        """Why it is unknown, in a sentence."""
        return self.wrapped.reason

    @property
    def proofs(self) -> tuple[Proof, ...]:
        """Why no run reaches it, where `induction` or `pdr` found that."""
        return self.wrapped.proofs

    @property
    def engine(self) -> str:
        """The engine that decided it, or those that were asked."""
        return self.wrapped.engine

    @property
    def exit_code(self) -> int:
        """As of ``llfsm query``: 0 reached, 1 unreachable, 4 unknown, 130 interrupted."""
        return self.wrapped.exit_code

    def to_dict(self) -> dict[str, Json]:
        """The JSON report (schema `query`) as dictionaries and lists."""
        from llfsm_verify.report.query import query_object

        return query_object(self.wrapped)


@dataclass(frozen=True, slots=True, repr=False)
class LintReport(Readable):
    """The findings of lint that no file accepts, one after the other. `wrapped` is the value inside, which is private.

    A finding has a `code`, a `level` (``warning`` or ``note``), a `message`, a `span` (its place) and a `hint`.
    """

    wrapped: LintResult

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.wrapped.shown)

    def __len__(self) -> int:
        """The number of findings."""
        return len(self.wrapped.shown)

    def __bool__(self) -> bool:
        """TypeError: without findings there may still be open questions."""
        raise TypeError("a report is neither true nor false: ask for its length, its open questions or exit_code")

    def __repr__(self) -> str:
        return f"<LintReport of {self.wrapped.arrangement}: {len(self)} findings, {len(self.open)} open questions>"

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.lint import lint_text

        return lint_text(self.wrapped)

    @property
    def accepted(self) -> tuple[Finding, ...]:
        """The findings that the files accept; `suppressed` of each says why."""
        return tuple(f for f in self.wrapped.findings if f.suppressed is not None)

    @property
    def open(self) -> tuple[OpenQuestion, ...]:
        """What is neither proved nor shown."""
        return self.wrapped.open

    @property
    def exit_code(self) -> int:
        """As of ``llfsm lint``: 0 no warnings, 1 warnings, 4 something is unknown."""
        return self.wrapped.exit_code

    def to_dict(self) -> dict[str, Json]:
        """The JSON report (schema `lint`) as dictionaries and lists."""
        from llfsm_verify.report.lint import lint_object

        return lint_object(self.wrapped)


@dataclass(frozen=True, slots=True, repr=False)
class CoverageReport(Readable):
    """What runs cover: its goals, one after the other. `wrapped` is the value inside, which is private.

    A goal has a `goal` (with `kind`, `machine`, `text` and `span`), a `status` (``covered``, ``reachable``,
    ``unreachable`` by proof or ``unknown``) and, where it is reachable, shortest `runs` that cover it.
    """

    wrapped: Coverage

    def __iter__(self) -> Iterator[Judged]:
        return iter(self.wrapped.goals)

    def __len__(self) -> int:
        """The number of goals."""
        return len(self.wrapped.goals)

    def __bool__(self) -> bool:
        """TypeError: coverage has many answers."""
        raise TypeError("coverage is neither true nor false: ask for its goals, its counts or exit_code")

    def __repr__(self) -> str:
        found = [judged.status for judged in self.wrapped.goals]
        counts = ", ".join(f"{found.count(status)} {status}" for status in dict.fromkeys(found))
        return f"<CoverageReport of {self.wrapped.arrangement}: {counts}>"

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.coverage import coverage_text

        return coverage_text(self.wrapped)

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """How many goals there are, by kind and then by status."""
        return {kind: dict(counts.items()) for kind, counts in self.wrapped.counts().items()}

    @property
    def exit_code(self) -> int:
        """As of ``llfsm coverage``: 0, 1 where runs miss what is reachable, 4 where something is unknown."""
        return self.wrapped.exit_code

    def to_dict(self) -> dict[str, Json]:
        """The JSON report (schema `coverage`) as dictionaries and lists."""
        from llfsm_verify.report.coverage import coverage_object

        return coverage_object(self.wrapped)


@dataclass(frozen=True, slots=True, repr=False)
class ReplayOutcome:
    """Whether what a saved trace shows still happens. `wrapped` is the value inside, which is private."""

    wrapped: Replayed

    def __bool__(self) -> bool:
        """TypeError: the trace may not fit."""
        raise TypeError("an outcome is neither true nor false: ask whether it `happens`")

    def __repr__(self) -> str:
        return f"<ReplayOutcome of {self.wrapped.file.path}: {self}>"

    def __str__(self) -> str:
        return self.wrapped.sentence

    @property
    def happens(self) -> bool | None:
        """True: the failure still happens; False: the run is possible and does not fail; None: it does not fit any
        more."""
        return {"violated": True, "holds": False, None: None}[self.wrapped.found]

    @property
    def as_expected(self) -> bool:
        """What happens is what the trace file expects (its `expect`)."""
        return self.wrapped.found == self.wrapped.file.expect

    @property
    def notes(self) -> tuple[str, ...]:
        """What has changed since the trace was saved."""
        return self.wrapped.notes

    @property
    def path(self) -> Path:
        """The trace file."""
        return Path(self.wrapped.file.path)

    @property
    def run(self) -> RunView | None:
        """What the executor did; None: it could not begin."""
        trace = self.wrapped.replay.trace
        return None if trace is None else RunView(trace, self.wrapped.arrangement)


@dataclass(frozen=True, slots=True, repr=False)
class RecordingOutcome:
    """Whether a recording of a run is the same when it is performed again. It has what a `ReplayOutcome` has, so that
    both are asked in one way. `wrapped` is the value inside, which is private."""

    wrapped: Repeated

    def __bool__(self) -> bool:
        """TypeError: the recording may be damaged."""
        raise TypeError("an outcome is neither true nor false: ask whether it `happens`")

    def __repr__(self) -> str:
        return f"<RecordingOutcome of {self.path}: {self}>"

    def __str__(self) -> str:
        return self.wrapped.sentence

    @property
    def happens(self) -> bool | None:
        """True: every frame is the same, bit for bit; False: one differs; None: the recording is damaged."""
        return self.wrapped.same

    @property
    def as_expected(self) -> bool:
        """Every frame is the same."""
        return self.wrapped.same is True

    @property
    def frames(self) -> int:
        """How many frames are the same, from the first one on."""
        return self.wrapped.frames

    @property
    def ending(self) -> str | None:
        """How the run ended, such as ``"stopped"``, ``"fault"`` or ``"died"``; None: the recording does not say it, as
        it ended before the run, or is damaged."""
        return None if self.wrapped.ending == "running" else self.wrapped.ending

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be said of the file."""
        return self.wrapped.notes

    @property
    def path(self) -> Path:
        """The recording."""
        return self.wrapped.path

    @property
    def run(self) -> RunView | None:
        """The ringlets that were recorded, as steps; None: a frame differs, the recording is damaged, or it begins
        where a machine was loaded."""
        from llfsm_verify.runtime.recording.repeating import trace_of

        trace = trace_of(self.wrapped)
        return None if trace is None else RunView(trace, self.wrapped.arrangement)
