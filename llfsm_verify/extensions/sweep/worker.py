"""One task performed in the process of a worker: its texts become files, the files a check, the check an outcome."""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from llfsm_verify import CheckOptions, CheckResult, Diagnostic, DiagnosticError, Disagreement, Model
from llfsm_verify.extensions.sweep.task import Outcome, State, Task
from llfsm_verify.extensions.sweep.values import NoSuchName, with_values
from llfsm_verify.plug import (
    ENGINES,
    REPORTS,
    Arrangement,
    GivenArrangement,
    Json,
    parse_properties,
    read_arrangement,
    read_properties,
    resolve,
    trace_documents,
)

LIMITS: Mapping[State, str] = {"timeout": "the time limit of ", "memory": "the memory limit of "}
"""How reasons begin that say which limit was reached, by what becomes of the task then."""
BAD_INPUT = 3
"""The exit code of `llfsm verify` for wrong files."""
GRACE = 1.2, 5.0
"""Of its time limit, and seconds beside that: what a task may take before its process is ended."""
ALONE = threading.Lock()
"""A process performs one task at a time: its memory is that of one, and solvers are not made for threads."""


def patience(timeout: float | None) -> float | None:
    """Seconds after which a task with this time limit is stuck."""
    return None if timeout is None else timeout * GRACE[0] + GRACE[1]


def guarded(task: Task) -> Outcome:
    """`perform`, in a process that ends, whatever it is doing, where the task is stuck."""
    with ALONE, open(os.devnull, "w", encoding="ascii") as nowhere:
        limit = patience(task.timeout)
        if limit is not None:  # a thread in C, which needs no lock of Python's
            faulthandler.dump_traceback_later(limit, exit=True, file=nowhere)
        try:
            return perform(task)
        finally:
            if limit is not None:
                faulthandler.cancel_dump_traceback_later()


def perform(task: Task) -> Outcome:
    """Check, and say what came of it: nothing is raised, whatever is wrong.

    Files are called as in the task. Where they are wrong, the result is what `llfsm verify --format json` says of
    that; it is None after an error of ours, and where the memory was used up.
    """
    started = time.perf_counter()
    reset_peak()
    outcome = _performed(task)
    return replace(outcome, seconds=time.perf_counter() - started, memory=peak())


def _performed(task: Task) -> Outcome:
    try:
        with _folder(task.files) as folder:
            try:
                return _checked(task, folder)
            except DiagnosticError as error:
                return _wrong(error.diagnostics, folder)
            except NoSuchName as error:
                known = ", ".join(error.known) or "none"
                return Outcome("failed", None, f"there is no {error.kind} `{error.name}`; there are: {known}")
    except MemoryError:
        return Outcome("memory", None, "out of memory")
    except Disagreement as error:
        return Outcome("failed", None, f"two parts of the toolkit disagree: {error}")
    except KeyboardInterrupt:
        return Outcome("failed", None, "interrupted")
    except Exception as error:  # noqa: BLE001 - whatever is wrong with one task does not end the others
        return Outcome("failed", None, f"internal error: {type(error).__name__}: {' '.join(str(error).split())[:300]}")


@contextmanager
def _folder(files: Iterable[tuple[str, str]]) -> Iterator[Path]:
    """A folder with these files, as long as it is needed. ValueError: one would be outside."""
    with TemporaryDirectory(prefix="llfsm-sweep-", ignore_cleanup_errors=True) as name:
        for path, text in files:
            if PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts:
                raise ValueError(f"the file {path} of a task is not below its folder")
            target = Path(name, path)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(text.encode("utf-8", "surrogatepass"))
        yield Path(name)


def _checked(task: Task, folder: Path) -> Outcome:
    options: dict[str, Any] = {"timeout": task.timeout, "memory": task.memory, **dict(task.options)}
    one = {"jobs": 1}
    if "jobs" in CheckOptions.__annotations__ and ENGINES.misplaced(options.get("engine", "auto"), one) is None:
        options = one | options
    draft = read_arrangement(GivenArrangement(folder / task.arrangement))
    arrangement = resolve(with_values(draft, task.values))
    asked = [folder / each for each in task.properties]
    found = Model(arrangement).check(asked, **options)
    state, message = _limit(found)
    result = json.loads(_without(folder, found.to_json()))
    return Outcome(state, result, message, traces=_traces(found, arrangement, asked, folder, options))


def _limit(found: CheckResult) -> tuple[State, str]:
    """Which limit ended the check, and the sentence that says so."""
    if found.interrupted:
        return "failed", "interrupted"
    reasons = [*(each.reason for each in found), found.faults.reason]
    for reason in filter(None, reasons):
        for state, begins in LIMITS.items():
            if begins in reason:
                return state, reason
    return "done", ""


def _traces(
    found: CheckResult, arrangement: Arrangement, asked: list[Path], folder: Path, options: Mapping[str, Any]
) -> tuple[tuple[str, str], ...]:
    properties = parse_properties([read_properties(path) for path in asked], options.get("syntax", "llfsm"))
    documents = trace_documents(found.wrapped, arrangement, properties, folder)
    return tuple((name, text) for name, _, text in documents)


def _wrong(diagnostics: Iterable[Diagnostic], folder: Path) -> Outcome:
    diagnostics = list(diagnostics)
    said = _without(folder, "\n".join(each.render() for each in diagnostics))
    failed = REPORTS.failed("json")
    assert failed is not None
    result: Json = json.loads(_without(folder, failed(diagnostics, BAD_INPUT)))
    return Outcome("failed", result, said)


def _without(folder: Path, text: str) -> str:
    """The text, of JSON or of messages, in which files are called as in the task."""
    return text.replace(json.dumps(f"{folder}/", ensure_ascii=False)[1:-1], "")


# ---------------------------------------------------------------- memory


def reset_peak() -> None:
    """From now on `peak` counts anew, where the system can do that."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_bytes(b"5")


def peak() -> int:
    """The most bytes of memory that this process had since `reset_peak`; elsewhere than on Linux since it began."""
    with suppress(OSError, ValueError):
        text = Path("/proc/self/status").read_text("ascii", "replace")
        return int(text.partition("VmHWM:")[2].split()[0]) * 1024
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024
