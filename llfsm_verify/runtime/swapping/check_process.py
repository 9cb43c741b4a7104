"""The check of a machine before it is loaded, in a process of its own: the loop and its supervisor go on meanwhile.

It makes both arrangements and asks; what a refused machine would do, the executor performs and records. The process is
forked from the supervisor, so it knows all that the run knows. It answers in a file in memory, and is ended when it
takes more time than it has.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import DiagnosticError, Disagreement, counted
from llfsm_verify.jsonvalue import Json
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live import signals
from llfsm_verify.runtime.live.forks import close_but, fork
from llfsm_verify.runtime.live.frame import CYCLE, PROCESS
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.plan import monitored, runnable, safe_values, starting_values
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.swapping.settings import Loaded, RunSettings
from llfsm_verify.verification.changes.state_transfer import UNKNOWN, Accepted

if TYPE_CHECKING:
    from llfsm_verify.verification.changes.update_check import Counterexample, Refusal

GRACE = 2
"""Seconds after its limit in which the process may say so itself."""
NICENESS = 10
PR_SET_PDEATHSIG = 1


@dataclass(frozen=True, slots=True)
class CheckAnswer:
    """What came of a check: `accepted`, or why the machine is refused; in both cases what else is to be said."""

    accepted: Accepted | None
    reason: str
    notes: tuple[str, ...]


class Check:
    """A check that is under way. `work` is done in another process. Where this one has other threads when it is made,
    one of them may hold a lock that the check wants: it is then ended when its time is over. OSError: there is no
    descriptor or process left for it.
    """

    def __init__(self, work: Callable[[], CheckAnswer], limits: Limits) -> None:
        self._file = os.memfd_create("llfsm-check", os.MFD_CLOEXEC)
        self._until = None if limits.timeout is None else time.monotonic() + limits.timeout + GRACE
        self._limits = limits
        self._answer: CheckAnswer | None = None
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
                self._answer = CheckAnswer(None, f"{UNKNOWN}: {limit}", ())
        return self._answer is not None

    @property
    def answer(self) -> CheckAnswer:
        """After it is `ready`."""
        assert self._answer is not None
        return self._answer

    def close(self) -> None:
        """End it, if it is still under way."""
        if self._answer is None:
            os.kill(self._pid, signal.SIGKILL)
            os.waitpid(self._pid, 0)
            os.close(self._file)
            self._answer = CheckAnswer(None, "the check was ended", ())


def _go_to_background(supervisor: int) -> None:
    """This process takes what others leave, ends with the supervisor, and leaves signals to it."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != supervisor:
        os._exit(1)
    signals.ignore()
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    os.nice(NICENESS)


def _read(file: int, status: int) -> CheckAnswer:
    with os.fdopen(os.dup(file), "rb") as told:
        told.seek(0)
        try:
            found: CheckAnswer = pickle.load(told)  # noqa: S301 - of our own process
        except Exception:  # noqa: BLE001 - a pickle that was cut short may raise anything
            how = f"signal {os.WTERMSIG(status)} ended its process" if os.WIFSIGNALED(status) else "its process failed"
            return CheckAnswer(None, f"{UNKNOWN}: {how}", ())
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

    def finding(self) -> CheckAnswer:
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
            return CheckAnswer(None, error.diagnostics[0].message, ())
        if isinstance(outcome, Refusal):
            return CheckAnswer(None, self._why(outcome, following), outcome.notes)
        return CheckAnswer(outcome, "", outcome.notes)

    def _resolved(self, draft: Draft) -> Arrangement:
        return runnable(resolve(draft), simulated=True, cycle_ms=self.settings.cycle_ms)

    def _why(self, refusal: Refusal, following: Arrangement) -> str:
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


class Interleaved(Exception):
    """The run takes turns of several processes in the middle of each other's cycles, which no run does."""


def record_counterexample(
    refusal: Refusal, following: Arrangement, properties: PropertySet, header: Mapping[str, Json], path: Path | None
) -> int:
    """Perform what `refusal` says would happen, and record it at `path`; how many cycles it takes.

    Interleaved: it cannot be performed so. Disagreement: the executor does something else. DiagnosticError: the
    recording cannot be written.
    """
    counterexample = refusal.counterexample
    assert counterexample is not None
    program, monitors, _ = monitored(following, properties)
    turns = list(_turns(program, counterexample))
    loop = Loop(LiveCode(program, monitors, safe_values(following)), held=starting_values(program))
    loop.begin_at(counterexample.record, counterexample.states)
    recorder = None if path is None else Recorder(path, header, loop)
    try:
        loop.begin(0)
        status = 0
        for turn in turns:
            status = _perform(loop, turn)
            if status:
                break
            loop.commit()
            if recorder is not None:
                recorder.reach()
        watched = refusal.broken is not None and refusal.broken in monitors
        seen = watched and loop.verdicts[list(monitors).index(str(refusal.broken))] == "violated"
        if watched and not seen and not counterexample.endless:
            raise Disagreement(f"the executor does not violate `{refusal.broken}` in the run that was found")
        if (refusal.broken is None) != bool(status):
            raise Disagreement("the executor does not end in a fault where the run that was found does")
        loop.end("fault" if status else "violated" if seen else "stopped", status)
    except OSError as error:  # no room, for example
        if recorder is None:
            raise
        recorder.path.unlink()
        raise DiagnosticError([recorder.problem(error)]) from None
    finally:
        if recorder is not None:
            recorder.close()
    return len(turns)


def _perform(loop: Loop, moves: Sequence[Move]) -> int:
    """One turn; the status of its last ringlet."""
    code = loop.code
    numbers = {choice.name: number for number, choice in enumerate(code.program.choices)}
    at = code.context.defaults
    choices = list(loop._context[at : at + len(numbers)])
    for name, value in moves[0].choices.items():
        choices[numbers[name]] = value
    script = [
        Prescribed(loop.steps + ringlet, numbers[name], value)
        for ringlet, move in enumerate(moves)
        if ringlet
        for name, value in move.choices.items()
    ]
    process, last = moves[0].process, loop.frame[PROCESS]
    assert process is not None
    loop.frame[CYCLE] += 0 <= last >= process
    loop.frame[PROCESS] = process
    return loop.perform(process, choices, script)


def _turns(program: Program, counterexample: Counterexample) -> Iterator[list[Move]]:
    """The moves of each turn. What the executor does alone decides where a cycle ends."""
    execution = Execution(program)
    record, turn = counterexample.record, list[Move]()
    cycle = execution.layout.reader(program.cycle)
    for move in counterexample.moves:
        if move.process is None:
            break  # the arrangement has ended, and so has its run
        if turn and turn[0].process != move.process:
            raise Interleaved
        result = execution.step(record, move)
        turn.append(move)
        record = result.record
        if result.status or cycle(record):
            yield turn
            turn = []
    if turn:
        yield turn
