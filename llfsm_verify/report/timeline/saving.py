"""The traces of a result as timelines, beside the trace files that can be run again."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.saving import SUFFIX, named_runs, refuse_special, unsaved
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.recording.timeline import Timeline, execution_of, timeline_of


def try_formats(formats: Iterable[str]) -> None:
    """ModuleNotFoundError: a package that one of these formats needs is not installed."""
    for name in formats:
        TIMELINES.load(name)(Timeline("", (), (), None), io.BytesIO())


def refuse_strangers(directory: Path, formats: Iterable[str], names: Iterable[str]) -> None:
    """DiagnosticError (E405): a timeline might replace a file that has no trace beside it, so that it is not ours.
    `names` are those of the properties."""
    known = frozenset(names)
    for suffix in map(ending, formats):
        ours = [p for p in directory.glob(f"*{suffix}") if p.name.partition(".")[0] in known or _of_fault(p)]
        refuse_special(ours)
        for path in ours:
            if not path.with_name(path.name.removesuffix(suffix) + SUFFIX).exists():
                message = "this file has no trace beside it, and a trace would replace it"
                hint = "name another folder, or remove it"
                raise DiagnosticError(Diagnostic("E405", message, hint=hint, file=str(path)))


def save_timelines(result: Result, arrangement: Arrangement, directory: Path, formats: Sequence[str]) -> list[Path]:
    """Write every trace of `result` in each of the formats, under the name of its trace file. Returns the files
    written; DiagnosticError (E405): that is not possible."""
    written = []
    execution = execution_of(arrangement)
    try:
        for name, shown, trace in named_runs(result):
            shows = shown.message if isinstance(shown, FaultSite) else shown.name
            for wanted in formats:
                path = directory / f"{name}{ending(wanted)}"
                refuse_special([path])
                with replacing(path) as file:
                    TIMELINES.load(wanted)(timeline_of(trace, arrangement, execution, shows), file)
                written.append(path)
    except OSError as error:
        raise unsaved(error, directory) from None
    return written


def ending(wanted: str) -> str:
    """What the names of files of a format end in."""
    return TIMELINES[wanted].suffixes[0]


def _of_fault(path: Path) -> bool:
    return path.name.startswith("fault-")
