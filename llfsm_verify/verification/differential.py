"""`--engine all`: every engine, two at a time in processes of their own, and whoever comes to an answer must agree. A
process gets a pickled job on standard input, and its answer is pickled on standard output.
"""

from __future__ import annotations

import copyreg
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from threading import Event
from types import MappingProxyType
from typing import BinaryIO, NoReturn

from llfsm_verify import interrupts
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Options, Progress, Result, Verdict
from llfsm_verify.collector import do_one_task
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.kept import keep_waiting
from llfsm_verify.limits import Budget, LimitReached, default_memory
from llfsm_verify.verification.merging import Merging
from llfsm_verify.verification.portfolio import EACH_ENGINE, Stage, has_no_bounds, limit_options

SIZE_BYTES = 8
DEBUG = "LLFSM_DEBUG"
"""With this environment variable set to 1 an internal error shows its traceback."""
INTERRUPTED = 130
"""The status of a worker that was interrupted before there was anything to say."""


@dataclass(frozen=True, slots=True)
class Job:
    engine: str
    problem: Problem
    options: Options
    begun: float = field(default_factory=time.monotonic)
    """On the clock of this machine: the time limit counts from then."""


@dataclass(frozen=True, slots=True)
class Reply:
    """A result, or what an engine that checks its own result found to be wrong."""

    result: Result | None
    disagreement: str | None = None
    missing: str | None = None
    """A module that is not installed."""
    failure: str | None = None
    """What else went wrong, which is our mistake."""


def read_only(items: dict[object, object]) -> MappingProxyType[object, object]:
    """What a pickle makes a read-only dictionary with, since pickles have no such type."""
    return MappingProxyType(items)


def _pickled(
    mapping: MappingProxyType[object, object],
) -> tuple[Callable[..., MappingProxyType[object, object]], tuple[dict[object, object]]]:
    return read_only, (dict(mapping),)


copyreg.pickle(MappingProxyType, _pickled)


def pack(job: Job) -> bytes:
    """The job as the worker reads it: its size, and the pickle."""
    data = pickle.dumps(job)
    return len(data).to_bytes(SIZE_BYTES, "little") + data


def main() -> None:
    """Read a job, do it, write the answer; ends this process."""
    said, sys.stdout = sys.stdout.buffer, sys.stderr  # nothing that is printed may get into the answer
    try:
        interrupts.serve(_leave)
        do_one_task()
        answer = _answered(sys.stdin.buffer)
    except KeyboardInterrupt:
        _leave()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # there is nothing left to end
    said.write(pickle.dumps(answer))
    said.flush()
    os._exit(0)  # the thread holds standard input


def _leave() -> NoReturn:
    os._exit(INTERRUPTED)


def _answered(source: BinaryIO) -> Reply:
    from llfsm_verify.diagnostics import Disagreement
    from llfsm_verify.verification.verify import checker

    size = int.from_bytes(source.read(SIZE_BYTES), "little")
    job = pickle.loads(source.read(size))  # noqa: S301 - from our own process
    assert isinstance(job, Job)
    threading.Thread(target=_end_with_the_caller, daemon=True).start()
    try:
        limits = job.options.limits
        left = None if limits.timeout is None else max(limits.timeout - (time.monotonic() - job.begun), 0.0)
        return Reply(checker(job.engine)(job.problem, replace(job.options, limits=limits.within(left))))
    except Disagreement as error:
        return Reply(None, str(error))
    except ModuleNotFoundError as error:
        return Reply(None, missing=error.name)
    except Exception as error:  # noqa: BLE001 - the process that asked says it, with its exit code
        if os.environ.get(DEBUG) == "1":
            traceback.print_exc()
        place = traceback.extract_tb(error.__traceback__)[-1]
        return Reply(None, failure=f"{type(error).__name__}: {error} ({place.name}, line {place.lineno})")


def _end_with_the_caller() -> None:
    """Nothing more comes on standard input; its end means that the caller no longer waits for the answer."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


NAME = "all"
AT_ONCE = 2
INTERVAL = 0.2
"""Seconds between two reports of progress."""
GRACE = 10.0
"""Seconds in which an engine that is interrupted may say what it has found."""
LATE = 1.5
"""Seconds after the time limit in which the others may say it: half a second longer than the harness works."""


_PROGRAM = """import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)
from llfsm_verify.verification.differential import main
main()"""
"""Until a worker can answer an interrupt, it ends it, and no traceback is shown."""


class EnginesDisagree(Disagreement):
    """Two engines have come to different answers: one of them is wrong."""

    def __init__(self, what: str, results: Mapping[str, Result]) -> None:
        """`results`: those of both, by engine."""
        super().__init__(what)
        self.results = results


def all_engines(problem: Problem, options: Options) -> Result:
    """Verdicts on which all engines agree that come to any. Raises EnginesDisagree; Disagreement, where an engine
    raises it; RuntimeError, when one ends without an answer."""
    started = time.monotonic()
    try:
        with Budget(options.limits):
            endless = has_no_bounds(problem.program())
    except LimitReached:
        return _nothing(problem, options)
    keep_waiting()  # for the workers
    workers = [_Worker(s, problem, options, endless=endless) for s in EACH_ENGINE]
    interrupted = False
    with ThreadPoolExecutor(AT_ONCE) as pool:
        futures = [pool.submit(w.run, started) for w in workers]
        try:
            _wait(futures, options, started, lambda: _stop(workers))
        except KeyboardInterrupt:
            interrupted = True
            for worker in workers:
                worker.interrupt()
            wait(futures, GRACE)
        finally:
            _stop(workers)
    answers = [f.result() for f in futures]
    results = {s.engine: a for s, a in zip(EACH_ENGINE, answers, strict=True) if a is not None}
    if not results and not interrupted:
        return _nothing(problem, options)
    if not results:
        raise KeyboardInterrupt
    compare(results)
    merging = Merging(problem, faults=options.faults)
    for engine, result in results.items():
        merging.add(engine, result)
    result = merging.result(NAME, time.monotonic() - started)
    return replace(result, interrupted=result.interrupted or interrupted)


def _nothing(problem: Problem, options: Options) -> Result:
    """What is said where the time was over before any engine had said anything."""
    from llfsm_verify.verification.verify import checker

    limits = options.limits.within(0.0)
    return replace(checker(EACH_ENGINE[0].engine)(problem, replace(options, limits=limits)), engine=NAME)


def _stop(workers: Iterable[_Worker]) -> None:
    for worker in workers:
        worker.stop()


def _wait(
    futures: Sequence[Future[Result | None]], options: Options, started: float, end: Callable[[], None] = lambda: None
) -> None:
    """Wait for all, or for the first that fails, and report meanwhile which are done and which are at work, and what
    those that are done say. `end` is called when it is LATE."""
    told, timeout = 0, options.limits.timeout
    while True:
        if timeout is not None and time.monotonic() - started > timeout + LATE:
            end()
        done, waiting = wait(futures, INTERVAL, return_when=FIRST_EXCEPTION)
        if options.decided is not None and len(done) > told and all(f.exception() is None for f in done):
            told = len(done)
            for known in (k for f in done if (result := f.result()) is not None for k in result.known()):
                options.decided(known)
        if not waiting or any(future.exception() is not None for future in done):
            return
        if options.progress is not None:
            engines = [stage.engine for stage in EACH_ENGINE]
            at_work = [name for name, future in zip(engines, futures, strict=True) if future.running()]
            ready = [name for name, future in zip(engines, futures, strict=True) if future.done()]
            doing = f"at work: {', '.join(at_work)}" + (f"; done: {', '.join(ready)}" if ready else "")
            options.progress(Progress(0, 0, 0, 0, time.monotonic() - started, 0, doing))


def compare(results: Mapping[str, Result]) -> None:
    """Raises EnginesDisagree when two results, by engine, have different answers to the same question."""
    said: dict[str | None, tuple[str, Verdict]] = {}
    for engine, result in results.items():
        verdicts: list[tuple[str | None, Verdict]] = [(p.name, p.verdict) for p in result.properties]
        for name, verdict in [*verdicts, (None, result.faults.verdict)]:
            if verdict is Verdict.UNKNOWN:
                continue
            other, first = said.setdefault(name, (engine, verdict))
            if first is not verdict:
                what = "faults" if name is None else f"property {name}"
                text = f"{what}: {first.value} by {other}, {verdict.value} by {engine}"
                raise EnginesDisagree(text, {e: results[e] for e in (other, engine)})


class _Worker:
    """A process that runs one engine. It ends when this process does, whatever ends that."""

    def __init__(self, stage: Stage, problem: Problem, options: Options, *, endless: bool) -> None:
        self._stage = stage
        self._problem = problem
        self._options = options
        self._endless = endless
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = Event()

    def run(self, started: float) -> Result | None:
        """What the engine says; None: it was ended before it could say anything."""
        begun = time.monotonic()
        options = self._wanted(started)
        if options is None or self._ended.is_set():
            return None
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
        # A session of its own, so that Ctrl-C reaches each engine once: through `interrupt`.
        command = [sys.executable, "-c", _PROGRAM]
        pipe = subprocess.PIPE
        with subprocess.Popen(  # noqa: S603 - our own code, and nothing of the user's is in the command
            command, stdin=pipe, stdout=pipe, env=environment, start_new_session=True
        ) as process:
            self._process = process
            if self._ended.is_set():  # it was ended while it began
                process.kill()
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                process.stdin.write(pack(Job(self._stage.engine, self._problem, options, begun)))
                process.stdin.flush()
            except BrokenPipeError:
                pass  # it has ended; the answer says so
            # The input stays open: its end tells the worker that no one is waiting any more.
            said = process.stdout.read()
        if not said and (self._ended.is_set() or process.returncode == INTERRUPTED):
            return None
        if not said:
            raise RuntimeError(f"the engine {self._stage.engine} ended without an answer (status {process.returncode})")
        answer = pickle.loads(said)  # noqa: S301 - from our own process
        assert isinstance(answer, Reply)
        if answer.disagreement is not None:
            raise Disagreement(answer.disagreement)
        if answer.missing is not None:
            raise ModuleNotFoundError(f"No module named {answer.missing!r}", name=answer.missing)
        if answer.failure is not None:
            raise RuntimeError(f"the engine {self._stage.engine} failed: {answer.failure}")
        return answer.result

    def _wanted(self, started: float) -> Options | None:
        limits = self._options.limits
        timeout = None if limits.timeout is None else limits.timeout - (time.monotonic() - started)
        if timeout is not None and timeout <= 0:
            if self._stage is not EACH_ENGINE[0]:
                return None
            timeout = 0.0  # one of them has to say so
        memory = (default_memory() if limits.memory is None else limits.memory) // AT_ONCE
        limits = replace(limits.within(timeout), memory=memory)
        here = replace(self._options, limits=limits, progress=None, decided=None, tell=None)
        return limit_options(self._stage, here, endless=self._endless)

    def interrupt(self) -> None:
        """Ask for what there is."""
        import signal

        self._ended.set()
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)

    def stop(self) -> None:
        """End it, or do not let it begin."""
        self._ended.set()
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
