"""The rows of a sweep: what came of each combination, and the file of results in which they are kept."""

from __future__ import annotations

import fcntl
import json
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import fields
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast, get_args

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify import SweepRow as Row
from llfsm_verify.extensions.sweep.codes import DAMAGED_ROW, OTHER_ROWS, WRONG_RESULTS
from llfsm_verify.extensions.sweep.plan import Combination, Plan
from llfsm_verify.extensions.sweep.spelling import words
from llfsm_verify.extensions.sweep.task import Outcome, State
from llfsm_verify.plug import Json, Source, Span, counted, write_whole

KIND = "sweep of llfsm-verify"
"""What the first line of a file of results says that it is."""
TRACES = ".traces"
SUFFIX = ".trace.yaml"
FAULTS = "faults"
CODES_OF_STATES = {"timeout": 4, "memory": 4, "failed": 3, "killed": 4}
"""Exit codes where there is no result."""
KINDS: Mapping[str, Any] = {
    **dict.fromkeys(("key", "state", "message"), str), **dict.fromkeys(("exit_code", "states", "memory"), int),
    **dict.fromkeys(("values", "verdicts", "reasons", "traces"), dict), "faults": list, "seconds": (int, float),
}  # fmt: skip
"""What stands in a line, by the fields of a row."""
_STREAMS = re.compile(r"/dev/(std|fd/)|/proc/")
AGAIN = ("failed", "killed")
"""States of rows that are checked again, since what came between may be gone."""


def row_of(combination: Combination, outcome: Outcome, traces: Mapping[str, str]) -> Row:
    """The row of an outcome. `traces`: the names of the files in which its traces are."""
    result = cast("dict[str, Any]", outcome.result or {})
    asked = [*result.get("properties", ()), *([{**result[FAULTS], "name": FAULTS}] if FAULTS in result else [])]
    return Row(
        combination.task.key,
        combination.values,
        outcome.state,
        result.get("exit_code", CODES_OF_STATES.get(outcome.state, 4)),
        {each["name"]: each["verdict"] for each in asked},
        {each["name"]: each["reason"] for each in asked if each["reason"]},
        tuple(each["code"] for each in result.get(FAULTS, {}).get("list", ())),
        result.get("states", 0),
        traces,
        outcome.message,
        round(outcome.seconds, 3),
        outcome.memory,
    )


def row_from(data: Json) -> Row:
    """A row as a file has it. ValueError: it is something else."""
    right = isinstance(data, dict) and data.keys() == KINDS.keys() and data["state"] in get_args(State)
    if not right or not all(isinstance(cast("dict[str, Json]", data)[name], kind) for name, kind in KINDS.items()):
        raise ValueError("this is not a row")
    found: dict[str, Any] = {**cast("dict[str, Any]", data)}
    said = [*found[FAULTS], *(text for name in ("verdicts", "reasons", "traces") for text in found[name].values())]
    if not all(isinstance(text, str) and "\0" not in text for text in said):
        raise ValueError("this is not a row")
    found[FAULTS] = tuple(found[FAULTS])
    return Row(**found)


# ---------------------------------------------------------------- the file


class ResultsFile:
    """Rows as lines of JSON after a line that says what they are: added as they come, in order at the end."""

    def __init__(self, path: Path, plan: Plan) -> None:
        """Read what is there. DiagnosticError (E596): it is something else, of another sweep, or cannot be written."""
        self.path = path
        self.known: dict[str, Row] = {}
        """The rows that need not be checked again, by their keys."""
        self._others: dict[str, Row] = {}
        """Those of no combination of this sweep, which stay in the file."""
        self.warnings: list[Diagnostic] = []
        head: dict[str, Json] = {"format": 1, "kind": KIND, "version": version("llfsm-verify"), "sweep": plan.digest}
        self._head = {**head, "combinations": len(plan.combinations)}
        self._lock: int | None = None
        try:
            self._hold()
            self._read(plan)
            self.write(self.known.values())
        except BaseException:
            self.close()
            raise

    @property
    def traces(self) -> Path:
        """The folder of traces."""
        return self.path.with_name(f"{self.path.name}{TRACES}")

    def add(self, row: Row) -> None:
        """Write one more line, now. DiagnosticError (E596)."""
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(_line(row_data(row)))
        except OSError as error:
            raise self._wrong(f"results cannot be written there: {error.strerror or 'input/output error'}") from None

    def write(self, rows: Iterable[Row]) -> None:
        """Write these rows, then those that are of no combination of this sweep. DiagnosticError (E596)."""
        text = "".join(_line(each) for each in (self._head, *map(row_data, (*rows, *self._others.values()))))
        write_whole(text, str(self.path), WRONG_RESULTS, "the file of results")
        self._hold()  # it is a new file

    def close(self) -> None:
        """Let other sweeps have the file."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _hold(self) -> None:
        """Keep the file, where there is one, from other sweeps. DiagnosticError (E596): one has it."""
        self.close()
        if not self.path.is_file():
            return
        with suppress(OSError):  # a file that cannot be opened is told of where it is read
            self._lock = os.open(self.path, os.O_RDONLY)
        if self._lock is not None:
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                message, hint = "another sweep is writing this file", "wait for it, or name another file with --results"
                raise self._wrong(message, hint) from None
            except OSError:  # a file system without locks
                self.close()

    def save(self, combination: Combination, outcome: Outcome) -> Row:
        """The row of an outcome, after its traces and its line are written. DiagnosticError (E596)."""
        folder = self.traces / combination.task.key[:16]
        files: dict[str, str] = {}
        for name, text in outcome.traces:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise self._wrong(f"traces cannot be saved: {error.strerror or 'input/output error'}") from None
            path = folder / f"{name}{SUFFIX}"
            write_whole(_placed(text, combination, folder), str(path), WRONG_RESULTS, "a trace")
            files[name] = path.relative_to(self.path.parent).as_posix()
        row = row_of(combination, outcome, files)
        self.add(row)
        return row

    def _read(self, plan: Plan) -> None:
        try:
            stream = str(self.path) == "-" or _STREAMS.match(str(self.path.absolute()))
            if stream or (self.path.exists() and not self.path.is_file()):
                message = "results are kept in a file, to go on from there, and this is not one"
                raise self._wrong(message, "name another file")
            data = self.path.read_bytes() if self.path.exists() else b""
        except (OSError, ValueError) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or "it has no such name"
            raise self._wrong(f"the file of results cannot be read: {reason}") from None
        if not data:
            return
        source, lines = Source(str(self.path), data.decode("utf-8", "replace")), data.splitlines(keepends=True)
        head = _head(lines[0])
        if head is None:
            raise self._wrong("this is not a file of results of a sweep", "name another file")
        wanted = {each.task.key for each in plan.combinations}
        meant = {words(dict(each.values)) for each in plan.combinations}
        read = 0
        at = len(lines[0].decode("utf-8", "replace"))
        for line in lines[1:]:
            start, at = at, at + len(line.decode("utf-8", "replace"))
            try:
                row = row_from(json.loads(line))
            except (ValueError, RecursionError):
                message = "this line cannot be read, so its combination is checked again"
                hint = "leave files of results as they are while a sweep runs"
                self.warnings.append(Diagnostic(DAMAGED_ROW, message, Span(source, start, at - 1), hint=hint))
                continue
            read += 1
            if row.key not in wanted and words(dict(row.values)) not in meant:
                self._others[row.key] = row
            files = (self.path.parent / file for file in row.traces.values())
            if row.key in wanted and row.state not in AGAIN and all(file.is_file() for file in files):
                self.known[row.key] = row
        others = len(self._others)
        ours = head.get("sweep") == plan.digest  # ended, perhaps, before its first row
        if read and others == read and not ours:
            hint = "name another file, or remove this one"
            raise self._wrong(f"this file has {counted(read, 'row')}, none of a combination of this sweep", hint)
        if others:
            belong, are = ("belongs", "it is") if others == 1 else ("belong", "they are")
            message = f"{counted(others, 'row')} of the file {belong} to no combination of this sweep; {are} kept"
            hint = "give each sweep a file of its own with --results"
            self.warnings.append(Diagnostic(OTHER_ROWS, message, hint=hint, file=str(self.path)))

    def _wrong(self, message: str, hint: str = "name a file in a folder that can be written") -> DiagnosticError:
        return DiagnosticError(Diagnostic(WRONG_RESULTS, message, hint=hint, file=str(self.path)))


def row_data(row: Row) -> dict[str, Json]:
    """A row for `json.dumps`."""
    return {each.name: _plain(getattr(row, each.name)) for each in fields(row)}


def _plain(value: Any) -> Json:
    return dict(value) if isinstance(value, Mapping) else list(value) if isinstance(value, tuple) else value


def _line(data: Mapping[str, Json]) -> str:
    text = json.dumps(data, ensure_ascii=False)
    return f"{text if text.isprintable() else json.dumps(data)}\n"  # names of files need not be Unicode


def _head(line: bytes) -> Mapping[str, Json] | None:
    """What the first line of a file of results says; None: it is not one."""
    try:
        head = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return head if isinstance(head, dict) and head.get("kind") == KIND and head.get("format") == 1 else None


def _placed(text: str, combination: Combination, folder: Path) -> str:
    """A trace that names its arrangement as seen from `folder`, and says which values it was found with."""
    path = Path(os.path.relpath(combination.root / combination.task.arrangement, folder)).as_posix()
    named = path if re.fullmatch(r"[\w./-]+", path, re.ASCII) else json.dumps(path)
    found = re.sub(r"^arrangement: .*$", lambda _: f"arrangement: {named}", text, count=1, flags=re.MULTILINE)
    said = ", ".join(f"{name} = {words(value)}" for _, name, value in combination.task.values)
    return f"# With {said}.\n{found}" if said else found
