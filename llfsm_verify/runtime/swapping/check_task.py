"""What the process does that checks a machine: it makes both arrangements, asks, and records what would go wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import DiagnosticError, counted
from llfsm_verify.limits import Budget
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.preparing import runnable
from llfsm_verify.runtime.swapping.check_process import Finding
from llfsm_verify.runtime.swapping.settings import Loaded, RunSettings

if TYPE_CHECKING:
    from llfsm_verify.verification.changes.update_check import Refusal

MOST_REFUSED = 1000
"""Recordings of refused machines beside one of a run."""


@dataclass(frozen=True, slots=True)
class CheckTask:
    """A machine or a policy to be checked: the last of `loaded`, of a run that stands at `record`."""

    settings: RunSettings
    running: Draft
    following: Draft
    loaded: tuple[Loaded, ...]
    code: LiveCode
    """Of the run."""
    record: bytes
    states: tuple[int, ...]
    """Of its monitors."""
    earlier: tuple[tuple[Draft, str | None], ...]
    """As of `Question`."""

    def finding(self) -> Finding:
        """The answer. Errors are mistakes of ours."""
        from llfsm_verify.verification.changes.update_check import Question, Refusal, check_update

        try:
            running, following = self._resolved(self.running), self._resolved(self.following)
            question = Question(
                running, following, self.loaded[-1].machine, self.settings.properties, self.code, self.record,
                self.states, tuple((self._resolved(draft), machine) for draft, machine in self.earlier),
            )  # fmt: skip
            outcome = check_update(question, Budget(self.settings.limits))
        except DiagnosticError as error:
            return Finding(None, error.diagnostics[0].message, ())
        if isinstance(outcome, Refusal):
            return Finding(None, self._why(outcome, following), outcome.notes)
        return Finding(outcome, "", outcome.notes)

    def _resolved(self, draft: Draft) -> Arrangement:
        return runnable(resolve(draft), simulated=True, cycle_ms=self.settings.cycle_ms)

    def _why(self, refusal: Refusal, following: Arrangement) -> str:
        from llfsm_verify.runtime.swapping.counterexample import Interleaved, record_counterexample

        if refusal.counterexample is None:
            return refusal.reason
        header = self.settings.header(following, self.loaded, {}, simulated=True)
        for path in self._paths():
            try:
                cycles = record_counterexample(refusal, following, self.settings.properties, header, path)
            except Interleaved:
                return f"{refusal.reason}, where ringlets of several processes alternate"
            except DiagnosticError as error:
                if path is not None and path.exists():
                    continue
                return f"{refusal.reason}; {error.diagnostics[0].message}"
            later = refusal.counterexample.later
            when = "" if not later else f", if it is loaded {counted(later, 'cycle')} from now"
            recorded = "" if path is None else f" (recorded in {path})"
            how = " by a run that repeats itself" if refusal.counterexample.endless else ""
            return f"{refusal.reason}{how} {counted(cycles, 'cycle')} after it is loaded{when}{recorded}"
        return refusal.reason

    def _paths(self) -> Iterator[Path | None]:
        """Where it may be recorded: beside the recording of the run, if there is one."""
        if self.settings.record is None:
            yield None
            return
        path = Path(self.settings.record)
        for number in range(1, MOST_REFUSED + 1):
            yield path.with_name(f"{path.name}.refused.{number}")
