"""Keeping the run of a failure as a trace file, once, and never over a file that shows something else."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.files import publish, unfinished
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.saving import SUFFIX, unsaved
from llfsm_verify.verification.replay import Load, replay_file
from llfsm_verify.verification.tracefile import SavedProperty


def keep_trace(
    directory: Path,
    name: str,
    what: SavedProperty | FaultSite,
    text: str,
    arrangement: Arrangement,
    load: Load,
) -> tuple[Path, bool]:
    """Write `text` as ``NAME.trace.yaml`` or, where that is taken, as ``NAME-2.trace.yaml`` and so on.

    Nothing is written when one of these files shows the same failure already, and still does when it is run again;
    `load` loads its arrangement. Returns the file that shows the failure, and whether it is a new one. Raises
    DiagnosticError (E405) when it cannot be written.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in _names(directory, name):
            if _create(path, text):
                return path, True
            if _shows(path, what, arrangement, load):
                return path, False
    except OSError as error:
        raise unsaved(error, directory) from None
    raise AssertionError("names do not end")


def _names(directory: Path, name: str) -> Iterator[Path]:
    for number in count(1):
        yield directory / f"{name}{f'-{number}' if number > 1 else ''}{SUFFIX}"


def _create(path: Path, text: str) -> bool:
    """Make a file that no process sees unfinished; False: there is one already, also when another process made it."""
    with unfinished(path) as (file, name):
        file.write(text.encode())
        file.close()
        return publish(name, path)


def _shows(path: Path, what: SavedProperty | FaultSite, arrangement: Arrangement, load: Load) -> bool:
    """Whether the file is a trace of the same arrangement in which the same thing still fails."""
    try:
        done = replay_file(os.fspath(path), None, load, chosen=True)
    except DiagnosticError:
        return False
    file = done.file
    if isinstance(what, FaultSite):
        same = file.fault is not None and file.fault == (what.code, what.message)
    else:
        same = file.goal is not None and (file.goal.kind, file.goal.text) == (what.kind, what.text)
    return same and Path(done.arrangement.path).samefile(arrangement.path) and done.found == "violated"
