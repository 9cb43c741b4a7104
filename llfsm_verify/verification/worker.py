"""One engine in a process of its own: a pickled job on standard input, the pickled answer on standard output."""

from __future__ import annotations

import copyreg
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import BinaryIO, NoReturn

from llfsm_verify import interrupts
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.collector import do_one_task

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
    """What a pickle makes a read-only dictionary with, since it knows none."""
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
        return Reply(checker(job.engine)(job.problem, job.options))
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
    """Nothing more comes on standard input; its end means that nobody waits for the answer."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)
