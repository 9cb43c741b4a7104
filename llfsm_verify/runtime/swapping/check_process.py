"""The check of a machine before it is loaded, in a process of its own: the loop and its supervisor go on meanwhile.

It makes both arrangements, asks, and records what would go wrong.

The process is forked from the supervisor, so it knows all that the run knows. It answers in a file in memory, and is
ended when it takes more time than it has.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import DiagnosticError, counted
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.runtime.live import signals
from llfsm_verify.runtime.live.forks import close_but, fork
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.plan import runnable
from llfsm_verify.runtime.swapping.settings import Loaded, RunSettings
from llfsm_verify.verification.changes.state_transfer import UNKNOWN, Accepted

if TYPE_CHECKING:
    from llfsm_verify.verification.changes.update_check import Refusal

GRACE = 2
"""Seconds after its limit in which the process may say so itself."""
NICENESS = 10
PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of a check: `accepted`, or why the machine is refused; in both cases what else is to be said."""

    accepted: Accepted | None
    reason: str
    notes: tuple[str, ...]


class Check:
    """A check that is under way. `work` is done in another process. Where this one has other threads when it is made,
    one of them may hold a lock that the check wants: it is then ended when its time is over. OSError: there is no
    descriptor or process left for it.
    """

    def __init__(self, work: Callable[[], Finding], limits: Limits) -> None:
        self._file = os.memfd_create("llfsm-check", os.MFD_CLOEXEC)
        self._until = None if limits.timeout is None else time.monotonic() + limits.timeout + GRACE
        self._limits = limits
        self._answer: Finding | None = None
        supervisor = os.getpid()
        try:
            self._pid = fork()
        except OSError:
            os.close(self._file)
            raise
        if not self._pid:
            try:
                _go_to_background(supervisor)
                close_but({0, 1, 2, self._file})
                with os.fdopen(os.dup(self._file), "wb") as out:
                    pickle.dump(work(), out)
            except BaseException:  # noqa: BLE001 - what is not answered is refused
                with suppress(OSError):
                    os.write(2, traceback.format_exc().encode())
            finally:
                os._exit(0)

    @property
    def ready(self) -> bool:
        """Whether there is an answer."""
        if self._answer is None:
            pid, status = os.waitpid(self._pid, os.WNOHANG)
            if pid:
                self._answer = _read(self._file, status)
                os.close(self._file)
            elif self._until is not None and time.monotonic() > self._until:
                self.close()
                limit = f"the time limit of {self._limits.timeout:g} s was reached"
                self._answer = Finding(None, f"{UNKNOWN}: {limit}", ())
        return self._answer is not None

    @property
    def answer(self) -> Finding:
        """After it is `ready`."""
        assert self._answer is not None
        return self._answer

    def close(self) -> None:
        """End it, if it is still under way."""
        if self._answer is None:
            os.kill(self._pid, signal.SIGKILL)
            os.waitpid(self._pid, 0)
            os.close(self._file)
            self._answer = Finding(None, "the check was ended", ())


def _go_to_background(supervisor: int) -> None:
    """This process takes what others leave, ends with the supervisor, and leaves signals to it."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != supervisor:
        os._exit(1)
    signals.ignore()
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    os.nice(NICENESS)


def _read(file: int, status: int) -> Finding:
    with os.fdopen(os.dup(file), "rb") as told:
        told.seek(0)
        try:
            found: Finding = pickle.load(told)  # noqa: S301 - of our own process
        except (EOFError, pickle.UnpicklingError):
            how = f"signal {os.WTERMSIG(status)} ended its process" if os.WIFSIGNALED(status) else "its process failed"
            return Finding(None, f"{UNKNOWN}: {how}", ())
    return found


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
