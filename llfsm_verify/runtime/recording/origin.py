"""The arrangement of a recording, made again from the texts in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.program import Int, Program
from llfsm_verify.runtime.live.preparing import runnable
from llfsm_verify.runtime.recording.codes import OTHER, UNREADABLE
from llfsm_verify.runtime.recording.file import Recording

Load = Callable[[str], Arrangement]
DEPTH = "d"
"""A folder for each level by which a file lies above the arrangement."""


def arrangement_of(recording: Recording, load: Load, instead: str | None = None) -> Arrangement:
    """The arrangement that a recording was made of, as it ran; `instead`: another file in its place.

    DiagnosticError (E481, E482): the recording has no such texts, or other ones than its frames were made with.
    """
    header = recording.header
    cycle = header.get("cycle_ms")
    try:
        length = None if cycle is None else Fraction(str(cycle))
    except (ValueError, ZeroDivisionError):
        raise _damaged(recording, "its cycle has no length") from None
    found = load(instead) if instead is not None else _from_texts(recording, load)
    return runnable(found, simulated=bool(header.get("simulated")), cycle_ms=length)


def free_of(recording: Recording, program: Program) -> dict[str, int]:
    """The values of inputs that never change, as they were in the run. DiagnosticError (E481)."""
    given = recording.header.get("free", {})
    known = {v.name: v.type for v in program.vars if v.free}
    if not isinstance(given, Mapping):
        raise _damaged(recording, "it has no free inputs")
    found: dict[str, int] = {}
    for name, value in given.items():
        kind = known.get(name)
        if not isinstance(kind, Int) or not isinstance(value, int) or not kind.low <= value <= kind.high:
            raise _damaged(recording, f"`{name[:60]}` has no such value at first")
        found[name] = value
    return found


def _from_texts(recording: Recording, load: Load) -> Arrangement:
    files, name = recording.header.get("files"), recording.header.get("arrangement")
    if (
        not isinstance(files, Mapping)
        or not all(isinstance(t, str) for t in files.values())
        or not isinstance(name, str)
    ):
        raise _damaged(recording, "it has no arrangement")
    above = max((Path(path).parts.count("..") for path in files), default=0)
    with TemporaryDirectory(prefix="llfsm-") as folder:
        root = Path(folder).resolve()
        home = root.joinpath(*[DEPTH] * above)
        for path, text in files.items():
            place = Path(os.path.normpath(home / path))
            if Path(path).is_absolute() or not place.is_relative_to(root):
                raise _damaged(recording, f"it names a file at `{path[:60]}`")
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_text(str(text), encoding="utf-8")
            except (OSError, ValueError):
                raise _damaged(recording, f"it names a file `{path[:60]!a}`, or that has no text") from None
        if name not in files:
            raise _damaged(recording, "the file of its arrangement is not in it")
        found = load(str(home / name))
    if found.digest != recording.header.get("digest"):
        message = "the texts in this recording are not those that it was made with"
        raise DiagnosticError(
            [Diagnostic(OTHER, message, file=str(recording.path), hint="name the arrangement with --arrangement")]
        )
    return replace(found, path=name)


def _damaged(recording: Recording, what: str) -> DiagnosticError:
    message = f"the recording is damaged: {what}"
    return DiagnosticError([Diagnostic(UNREADABLE, message, file=str(recording.path), hint="record again")])
