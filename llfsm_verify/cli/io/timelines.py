"""Timelines in files and on standard output."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.output import Output
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing
from llfsm_verify.report.timeline import UNWRITABLE
from llfsm_verify.report.timeline.formats import TIMELINES

if TYPE_CHECKING:
    from llfsm_verify.runtime.recording.timeline import Timeline


def write_timeline(timeline: Timeline, wanted: str, output: str | None) -> None:
    """To a file as a whole, or to standard output (None, "-"). DiagnosticError (E487): it cannot be written there."""
    write = TIMELINES.load(wanted)
    try:
        if output is None or output == "-":
            buffer = io.BytesIO()
            write(timeline, buffer)
            Output().plain(buffer.getvalue().decode("utf-8"))
        elif Path(output).exists() and not Path(output).is_file():
            with Path(output).open("wb") as device:
                write(timeline, device)
        else:
            with replacing(Path(output).resolve()) as file:
                write(timeline, file)
    except (OSError, ValueError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or "input/output error"
        message = f"the timeline cannot be written there: {why}"
        raise DiagnosticError(Diagnostic(UNWRITABLE, message, file=output)) from None
