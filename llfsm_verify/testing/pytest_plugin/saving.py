"""Saving the run that fails a check, as a trace file that goes on failing until the model is mended."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import FaultResult, Result
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.replaying import replay_file
from llfsm_verify.report.saving import trace_documents, unsaved
from llfsm_verify.report.tracefile import SavedProperty
from llfsm_verify.semantics.program import FaultSite
from llfsm_verify.testing.pytest_plugin.session import session_of
from llfsm_verify.testing.pytest_plugin.texts import SAVE, SUFFIX

if TYPE_CHECKING:
    import pytest


def save_failure(
    result: Result,
    arrangement: Arrangement,
    properties: PropertySet,
    violated: frozenset[str],
    request: pytest.FixtureRequest,
    *,
    faults: bool,
) -> list[str]:
    """Save the traces that were not expected where `--llfsm-save` or the ini key says; a line about each.

    A failure that a file of that name already shows is not saved a second time; another one gets a name with a number.
    Raises DiagnosticError (E405).
    """
    named = str(request.config.getoption(SAVE) or request.config.getini(SAVE))
    items = tuple(item for item in result.properties if item.trace is not None and item.name not in violated)
    unexpected = replace(result, properties=items, faults=result.faults if faults else _none(result.faults))
    if not named or not (items or unexpected.faults.findings):
        return []
    if not Path(arrangement.path).is_file():
        return ["no trace saved: the arrangement does not come from a file"]
    directory = Path(request.path).parent / named
    lines = []
    for name, what, text in trace_documents(unexpected, arrangement, properties, directory, "holds"):
        shows = partial(_shows, what=what, arrangement=arrangement, request=request)
        lines.append(_write(directory, name, text, shows))
    return lines


def _none(faults: FaultResult) -> FaultResult:
    return replace(faults, findings=())


def _write(directory: Path, name: str, text: str, shows: Callable[[Path], bool]) -> str:
    """Write under the first name that is free, unless a file before it shows the failure."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in _names(directory, name):
            try:
                # One step, so that two workers never write one file.
                with path.open("x", encoding="utf-8") as file:
                    file.write(text)
            except FileExistsError:
                if shows(path):
                    return f"trace saved before: {path}"
                continue
            return f"trace saved: {path}"
    except OSError as error:
        raise unsaved(error, directory) from None
    raise AssertionError("names do not end")


def _names(directory: Path, name: str) -> Iterator[Path]:
    for number in count(1):
        yield directory / f"{name}{f'-{number}' if number > 1 else ''}{SUFFIX}"


def _shows(
    path: Path, what: SavedProperty | FaultSite, arrangement: Arrangement, request: pytest.FixtureRequest
) -> bool:
    """Whether the file is a trace of the same arrangement in which the same thing still fails."""
    try:
        done = replay_file(os.fspath(path), None, session_of(request.config).arrangement)
    except DiagnosticError:
        return False
    file = done.file
    if isinstance(what, FaultSite):
        same = file.fault is not None and file.fault[0] == what.code
    else:
        same = file.goal is not None and (file.goal.kind, file.goal.text) == (what.kind, what.text)
    return same and Path(done.arrangement.path).samefile(arrangement.path) and done.found == "violated"
